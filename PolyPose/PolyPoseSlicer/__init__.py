"""The parts of the PolyPose module that know MRML, Qt or Slicer; the computing is in PolyPoseLib."""
