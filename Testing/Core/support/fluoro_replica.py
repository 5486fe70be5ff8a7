"""DeepFluoro in small: the file's own layout at its own size, and the folder that is made of it, from formulas.

A point X of a bone's CT lands at K E P^-1 (X + H), P being "cam-to-...-vol" (hdf5_layouts/Readme.md), H half a voxel:
the published poses were found by a renderer that put voxels half a voxel from where they are (xreg takes it out). K has
negative focal lengths, and the camera's z points to the source. Pictures are of balls, whose chords are known; nothing
of the program is used.
"""

import h5py
import numpy as np
import pydicom
import torch
from pydicom.dataset import FileMetaDataset
from pydicom.uid import ExplicitVRLittleEndian, XRayRadiofluoroscopicImageStorage, generate_uid
from two_postures import moved, rigid, rotation, write_image

SIZE, PITCH, DISTANCE = 1536, 0.194, 1020.0
K = np.array([[-DISTANCE / PITCH, 0, 767.5], [0, -DISTANCE / PITCH, 767.5], [0, 0, 1.0]])
SHAPE = (44, 48, 52)
ORIGIN = np.array([-104.0, -310.0, -900.0])
CENTRE = ORIGIN + 2.0 * (np.array(SHAPE[::-1]) - 1)  # of a grid of 4 mm
E = rigid((0.3, 1, 0.2), 25.0, (12.0, -8.0, 30.0))
HALF_VOXEL = rigid((1, 0, 0), 0.0, (2.0, 2.0, 2.0))

BALLS = {  # label: (centre, radius) in the CT
    1: (np.add(CENTRE, [30, 0, 20]), 22.0),
    2: (np.add(CENTRE, [-30, 4, 22]), 22.0),
    3: (np.add(CENTRE, [0, 10, 50]), 16.0),
    5: (np.add(CENTRE, [46, -6, -44]), 15.0),
    6: (np.add(CENTRE, [-46, -2, -44]), 15.0),
}
MARKER = (np.add(CENTRE, [12, -30, -10]), 5.0)  # of metal, fixed to the pelvis
FEMUR = {
    9: rigid((1, 0, 0.2), 10, (3, 6, -4), BALLS[5][0]),
    0: rigid((0, 1, 0), 20, (14, -5, 2), BALLS[5][0]),
}
FEMUR[10] = FEMUR[3] = FEMUR[4] = FEMUR[9]
FEMUR[1] = FEMUR[0]
FRAMES = (0, 1, 3, 9, 10)
TURNED = (10, 1)
UNSEEN = (1,)  # right femur


def to_camera(number):
    """(4, 4) from the pelvis's CT to the camera's own axes in a frame."""
    # 80 % of the way from source to detector, seen from the front, the head up or down.
    front = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    if number in TURNED:
        front = np.diag([-1.0, -1.0, 1.0]) @ front
    pose = np.eye(4)
    pose[:3, :3] = rotation((0.1, 1, 0.3), 7.0 * number - 30) @ front
    pose[:3, 3] = [0, 0, -750.0 - 4 * number] - pose[:3, :3] @ CENTRE
    return pose


def cam_to_vol(number, bone):
    """As the file has it: from the camera's world to half a voxel beside a bone's CT."""
    place = {"pelvis": np.eye(4), "left-femur": FEMUR[number], "right-femur": np.eye(4)}[bone]
    return HALF_VOXEL @ np.linalg.inv(place) @ np.linalg.inv(to_camera(number)) @ E


def stored_pixel(number, point):
    """(column, row) in the stored picture of a point of the pelvis's CT."""
    x = K @ moved(to_camera(number), np.asarray(point))
    return x[:2] / x[2]


def _chords(number, centre, radius):
    """Row and column ranges, and mm (h, w), of a ball's chords in the stored picture."""
    at = moved(to_camera(number), centre)
    column, row = stored_pixel(number, centre)
    half = int(1.2 * radius * DISTANCE / PITCH / abs(at[2])) + 3
    rows = np.arange(max(int(row) - half, 0), min(int(row) + half, SIZE - 1) + 1)
    columns = np.arange(max(int(column) - half, 0), min(int(column) + half, SIZE - 1) + 1)
    x, y = np.meshgrid((columns - K[0, 2]) / K[0, 0], (rows - K[1, 2]) / K[1, 1])
    along = x * at[0] + y * at[1] + at[2]
    squared = x**2 + y**2 + 1
    distance = at @ at - along**2 / squared
    return rows, columns, 2 * np.sqrt(np.maximum(radius**2 - distance, 0))


def picture(number):
    """Intensities and 2D labels as they are stored."""
    line = np.full((SIZE, SIZE), 0.4, np.float32)
    labels = np.zeros((SIZE, SIZE), np.uint8)
    balls = {label: (centre, radius, 0.02) for label, (centre, radius) in BALLS.items()}
    centre, radius, mu = balls[5]
    balls[5] = (moved(FEMUR[number], centre), radius, mu)
    for label, (centre, radius, mu) in {**balls, 0: (*MARKER, 0.4)}.items():
        rows, columns, mm = _chords(number, centre, radius)
        line[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] += mu * mm
        if label:
            labels[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1][mm > 0] = label
    return np.rint(65000 * np.exp(-line)).astype(np.float32), labels


def volume():
    """HU and labels (k, j, i)."""
    k, j, i = np.indices(SHAPE)
    points = ORIGIN + 4.0 * np.stack([i, j, k], axis=-1)
    hu = np.where((np.abs(points - CENTRE) / [98, 88, 84] < 1).all(axis=-1), 20.0, -1000.0).astype(np.float32)
    labels = np.zeros(SHAPE, np.uint8)
    for label, (centre, radius) in BALLS.items():
        labels[((points - centre) ** 2).sum(-1) < radius**2] = label
    hu[labels > 0] = 900 + 10.0 * labels[labels > 0].astype(float)
    return hu, labels


def _image(group, pixels, spacing, origin):
    group["pixels"] = pixels
    group["spacing"] = np.reshape(spacing, (-1, 1))
    group["origin"] = np.reshape(origin, (-1, 1))
    group["dir-mat"] = np.eye(len(origin))


def write_hdf5(path, specimen="17-1882", frames=FRAMES):
    hu, labels = volume()
    with h5py.File(path, "w") as file:
        parameters = file.create_group("proj-params")
        parameters["intrinsic"], parameters["extrinsic"] = K, E
        parameters["num-cols"], parameters["num-rows"] = SIZE, SIZE
        parameters["pixel-col-spacing"], parameters["pixel-row-spacing"] = PITCH, PITCH
        subject = file.create_group(specimen)
        _image(subject.create_group("vol"), hu, [4, 4, 4], ORIGIN)
        _image(subject.create_group("vol-seg/image"), labels, [4, 4, 4], ORIGIN)
        for number in frames:
            frame = subject.create_group(f"projections/{number:03d}")
            image, drawn = picture(number)
            pixels = frame.create_group("image")
            pixels.create_dataset("pixels", data=image, compression="lzf")
            frame.create_group("gt-seg").create_dataset("pixels", data=drawn, compression="lzf")
            poses = frame.create_group("gt-poses")
            for bone in ("pelvis", "left-femur", "right-femur"):
                poses[f"cam-to-{bone}-vol"] = cam_to_vol(number, bone)
            poses["left-femur-good-fov"] = np.uint8(1)
            poses["right-femur-good-fov"] = np.uint8(number not in UNSEEN)
            frame["rot-180-for-up"] = np.uint8(number in TURNED)
    return path


def write_folder(
    root, subject="subject01", frames=FRAMES, origin=(5.0, 7.0, -3.0), newer=False, numbers=torch.float32
):
    """What xvr's utils/dcmwrite.py makes of the file, whose volume has another origin; newer poses are turned."""
    hu, labels = volume()
    affine = np.diag([4.0, 4.0, 4.0, 1.0])
    affine[:3, 3] = origin
    folder = root / subject
    write_image(hu, affine, folder / "volume.nii.gz")
    write_image(labels, affine, folder / "mask.nii.gz")
    (folder / "xrays").mkdir()
    flip, half_turn = -np.eye(4), np.diag([-1.0, -1.0, 1.0, 1.0])
    flip[3, 3] = 1
    middle = np.eye(4)
    middle[:3, 3] = -CENTRE
    reorient = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    for number in frames:
        image = picture(number)[0].astype(np.uint16)
        pose = half_turn @ middle @ cam_to_vol(number, "pelvis") @ np.linalg.inv(E) @ flip
        if number in TURNED:
            image, pose = np.rot90(image, 2), pose @ half_turn
        pose = pose @ np.linalg.inv(reorient)
        if newer:
            pose = pose @ half_turn
        pose = torch.tensor(pose, dtype=numbers)[None]
        sides = {"height": np.int64(SIZE), "width": np.int64(SIZE)}
        lengths = {"sdd": np.float64(DISTANCE), "delx": PITCH, "dely": PITCH, "x0": -0.097, "y0": -0.097}
        torch.save({"pose": pose, "intrinsics": {**lengths, **sides}}, folder / "xrays" / f"{number:03d}.pt")
        _write_dicom(folder / "xrays" / f"{number:03d}.dcm", image)
    return folder


def _write_dicom(path, image):
    file = pydicom.Dataset()
    file.file_meta = FileMetaDataset()
    file.file_meta.MediaStorageSOPClassUID = XRayRadiofluoroscopicImageStorage
    file.file_meta.MediaStorageSOPInstanceUID = generate_uid()
    file.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    file.Rows, file.Columns = image.shape
    file.PixelSpacing, file.DistanceSourceToDetector = [PITCH, PITCH], DISTANCE
    file.DetectorActiveOrigin = [-0.097, -0.097]
    file.BitsStored = file.BitsAllocated = 16
    file.HighBit, file.PixelRepresentation, file.SamplesPerPixel = 15, 0, 1
    file.PhotometricInterpretation = "MONOCHROME2"
    file.PixelData = np.ascontiguousarray(image).tobytes()
    file.save_as(path, enforce_file_format=True)
