<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de" sourcelanguage="en">
<context>
    <name>PolyPose</name>
    <message>
        <source>Aligns one CT to two or more X-rays of the same patient in another posture: every bone keeps its shape and gets its own rigid motion, soft tissue follows smoothly. Research software, not for clinical decisions.</source>
        <translation>Passt ein CT an zwei oder mehr Röntgenbilder desselben Patienten in anderer Haltung an: Jeder Knochen behält seine Form und bewegt sich als starrer Körper, die Weichteile folgen stetig. Forschungssoftware, nicht für klinische Entscheidungen.</translation>
    </message>
    <message>
        <source>The method is the polyrigid 2D/3D registration of Gopalakrishnan et al. (PolyPose, 2025).</source>
        <translation>Das Verfahren ist die polyrigide 2D/3D-Registrierung von Gopalakrishnan et al. (PolyPose, 2025).</translation>
    </message>
    <message>
        <source>Research software, not for clinical decisions.</source>
        <translation>Forschungssoftware, nicht für klinische Entscheidungen.</translation>
    </message>
    <message>
        <source>1. CT and bones</source>
        <translation>1. CT und Knochen</translation>
    </message>
    <message>
        <source>CT:</source>
        <translation>CT:</translation>
    </message>
    <message>
        <source>The preoperative CT, in Hounsfield units.</source>
        <translation>Das präoperative CT in Hounsfield-Einheiten.</translation>
    </message>
    <message>
        <source>Choose the CT</source>
        <translation>CT wählen</translation>
    </message>
    <message>
        <source>Segmentation:</source>
        <translation>Segmentierung:</translation>
    </message>
    <message>
        <source>Segmentation of the CT with one segment per bone.</source>
        <translation>Segmentierung des CT mit einem Segment je Knochen.</translation>
    </message>
    <message>
        <source>Choose the segmentation</source>
        <translation>Segmentierung wählen</translation>
    </message>
    <message>
        <source>Segment bones</source>
        <translation>Segmentieren</translation>
    </message>
    <message>
        <source>Segment the CT with the extension TotalSegmentator or MONAIAuto3DSeg, and propose the structures.</source>
        <translation>Das CT mit der Erweiterung TotalSegmentator oder MONAIAuto3DSeg segmentieren und die Strukturen vorschlagen.</translation>
    </message>
    <message>
        <source>Propose structures</source>
        <translation>Strukturen vorschlagen</translation>
    </message>
    <message>
        <source>Give every segment whose name is that of a bone, as TotalSegmentator names them, its usual structure, and choose an anchor.</source>
        <translation>Jedem Segment, das den Namen eines Knochens trägt, wie TotalSegmentator ihn nennt, seine übliche Struktur geben und einen Anker wählen.</translation>
    </message>
    <message>
        <source>How finely the spine and the ribs are divided.</source>
        <translation>Wie fein Wirbelsäule und Rippen unterteilt werden.</translation>
    </message>
    <message>
        <source>Spine and ribs by region</source>
        <translation>Wirbel, Rippen je Region</translation>
    </message>
    <message>
        <source>Every vertebra and rib</source>
        <translation>Jeder Wirbel, jede Rippe</translation>
    </message>
    <message>
        <source>Show only the segments whose name or structure contains this text.</source>
        <translation>Nur die Segmente zeigen, deren Name oder Struktur diesen Text enthält.</translation>
    </message>
    <message>
        <source>Search segments</source>
        <translation>Segmente suchen</translation>
    </message>
    <message>
        <source>Included only</source>
        <translation>Nur einbezogene</translation>
    </message>
    <message>
        <source>Hide the segments that do not move as a bone.</source>
        <translation>Die Segmente ausblenden, die sich nicht als Knochen bewegen.</translation>
    </message>
    <message>
        <source>A structure is what moves as one rigid body: segments with the same structure move together. The anchor stays where it is and defines the cameras.</source>
        <translation>Eine Struktur ist, was sich als ein starrer Körper bewegt: Segmente mit derselben Struktur bewegen sich gemeinsam. Der Anker bleibt an seinem Ort und legt die Kameras fest.</translation>
    </message>
    <message>
        <source>2. X-rays</source>
        <translation>2. Röntgenbilder</translation>
    </message>
    <message>
        <source>A loaded X-ray: a volume of one image, or a sequence of them.</source>
        <translation>Ein geladenes Röntgenbild: ein Volumen aus einem Bild oder eine Sequenz solcher Volumen.</translation>
    </message>
    <message>
        <source>Loaded X-ray</source>
        <translation>Geladenes Bild</translation>
    </message>
    <message>
        <source>Add</source>
        <translation>Hinzufügen</translation>
    </message>
    <message>
        <source>Add the chosen X-ray to the table.</source>
        <translation>Das gewählte Röntgenbild in die Tabelle aufnehmen.</translation>
    </message>
    <message>
        <source>Add X-rays from files.</source>
        <translation>Röntgenbilder aus Dateien hinzufügen.</translation>
    </message>
    <message>
        <source>Files...</source>
        <translation>Dateien...</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>Entfernen</translation>
    </message>
    <message>
        <source>Take the selected X-ray out of the table; the image itself stays.</source>
        <translation>Das gewählte Röntgenbild aus der Tabelle nehmen; das Bild selbst bleibt.</translation>
    </message>
    <message>
        <source>Geometry of the selected X-ray</source>
        <translation>Geometrie des gewählten Röntgenbilds</translation>
    </message>
    <message>
        <source>Name:</source>
        <translation>Name:</translation>
    </message>
    <message>
        <source>What this X-ray is called in tables and views.</source>
        <translation>Wie dieses Röntgenbild in Tabellen und Ansichten heißt.</translation>
    </message>
    <message>
        <source>Frame:</source>
        <translation>Einzelbild:</translation>
    </message>
    <message>
        <source>Which image of the sequence or of the file, counted from 1.</source>
        <translation>Welches Bild der Sequenz oder der Datei, ab 1 gezählt.</translation>
    </message>
    <message>
        <source>Camera is:</source>
        <translation>Die Kamera ist:</translation>
    </message>
    <message>
        <source>How the registration treats the camera: as an initial camera to refine, as exactly known, or as unknown.</source>
        <translation>Wie die Registrierung die Kamera behandelt: als Startkamera, die verfeinert wird, als genau bekannt oder als unbekannt.</translation>
    </message>
    <message>
        <source>an initial camera</source>
        <translation>eine Startkamera</translation>
    </message>
    <message>
        <source>known exactly</source>
        <translation>genau bekannt</translation>
    </message>
    <message>
        <source>to be found</source>
        <translation>zu suchen</translation>
    </message>
    <message>
        <source>Source to detector [mm]:</source>
        <translation>Fokus-Detektor [mm]:</translation>
    </message>
    <message>
        <source>Distance from the X-ray source to the detector. Leave it empty to use the value in the file.</source>
        <translation>Abstand von der Röntgenquelle zum Detektor. Leer lassen, um den Wert der Datei zu verwenden.</translation>
    </message>
    <message>
        <source>Source to isocentre [mm]:</source>
        <translation>Fokus-Isozentrum [mm]:</translation>
    </message>
    <message>
        <source>Distance from the X-ray source to the C-arm&apos;s isocentre. Leave it empty to use the value in the file.</source>
        <translation>Abstand von der Röntgenquelle zum Isozentrum des C-Bogens. Leer lassen, um den Wert der Datei zu verwenden.</translation>
    </message>
    <message>
        <source>Distance of pixel centres, between rows and between columns.</source>
        <translation>Abstand der Pixelmitten, zwischen Zeilen und zwischen Spalten.</translation>
    </message>
    <message>
        <source>Pixel spacing [mm]:</source>
        <translation>Pixelabstand [mm]:</translation>
    </message>
    <message>
        <source>Distance between rows on the detector, not at the patient. Leave it empty to use the value in the file.</source>
        <translation>Abstand der Zeilen auf dem Detektor, nicht im Patienten. Leer lassen, um den Wert der Datei zu verwenden.</translation>
    </message>
    <message>
        <source>Distance between columns on the detector, not at the patient. Leave it empty to use the value in the file.</source>
        <translation>Abstand der Spalten auf dem Detektor, nicht im Patienten. Leer lassen, um den Wert der Datei zu verwenden.</translation>
    </message>
    <message>
        <source>Column and row of the pixel on which the beam is perpendicular, counted from 0.</source>
        <translation>Spalte und Zeile des Pixels, auf dem der Strahl senkrecht steht, ab 0 gezählt.</translation>
    </message>
    <message>
        <source>Principal point [px]:</source>
        <translation>Hauptpunkt [px]:</translation>
    </message>
    <message>
        <source>Where the perpendicular from the source meets the detector, in the file&apos;s own pixels; the first pixel&apos;s centre is 0. Leave it empty for the centre of the image, or the value in the file.</source>
        <translation>Wo das Lot von der Röntgenquelle den Detektor trifft, in Pixeln der Datei; die Mitte des ersten Pixels ist 0. Leer lassen für die Bildmitte oder den Wert der Datei.</translation>
    </message>
    <message>
        <source>The row of the same point.</source>
        <translation>Die Zeile desselben Punkts.</translation>
    </message>
    <message>
        <source>LAO + / RAO - [deg]:</source>
        <translation>LAO + / RAO - [deg]:</translation>
    </message>
    <message>
        <source>Primary angle of the C-arm; positive with the detector toward the patient&apos;s left (LAO). Leave it empty to use the value in the file.</source>
        <translation>Primärer Winkel des C-Bogens; positiv, wenn der Detektor zur linken Seite des Patienten zeigt (LAO). Leer lassen, um den Wert der Datei zu verwenden.</translation>
    </message>
    <message>
        <source>CRA + / CAU - [deg]:</source>
        <translation>CRA + / CAU - [deg]:</translation>
    </message>
    <message>
        <source>Secondary angle of the C-arm; positive with the detector toward the head (CRA). Leave it empty to use the value in the file.</source>
        <translation>Sekundärer Winkel des C-Bogens; positiv, wenn der Detektor zum Kopf zeigt (CRA). Leer lassen, um den Wert der Datei zu verwenden.</translation>
    </message>
    <message>
        <source>Patient position:</source>
        <translation>Patientenlagerung:</translation>
    </message>
    <message>
        <source>Head or feet first; supine, prone or on one side. Used with angles that are entered here.</source>
        <translation>Kopf oder Füße voran; Rücken-, Bauch- oder Seitenlage. Gilt zusammen mit hier eingegebenen Winkeln.</translation>
    </message>
    <message>
        <source>Image seen from:</source>
        <translation>Bild gesehen von:</translation>
    </message>
    <message>
        <source>C-arms display the image as seen from the detector; a film on a view box may be the other way round.</source>
        <translation>C-Bögen zeigen das Bild vom Detektor aus gesehen; ein Film am Lichtkasten kann seitenverkehrt dazu sein.</translation>
    </message>
    <message>
        <source>as in the file</source>
        <translation>wie in der Datei</translation>
    </message>
    <message>
        <source>the detector (mirrored)</source>
        <translation>dem Detektor (gespiegelt)</translation>
    </message>
    <message>
        <source>the source</source>
        <translation>der Röntgenquelle</translation>
    </message>
    <message>
        <source>Distortion:</source>
        <translation>Verzeichnung:</translation>
    </message>
    <message>
        <source>Image intensifiers bend straight lines. An image with a round field counts as distorted, and its uncertainties are wider, unless it was corrected.</source>
        <translation>Bildverstärker biegen gerade Linien. Ein Bild mit rundem Feld gilt als verzeichnet, und seine Unsicherheiten sind größer, sofern es nicht korrigiert wurde.</translation>
    </message>
    <message>
        <source>by the field&apos;s shape</source>
        <translation>nach der Form des Feldes</translation>
    </message>
    <message>
        <source>corrected</source>
        <translation>korrigiert</translation>
    </message>
    <message>
        <source>not corrected</source>
        <translation>nicht korrigiert</translation>
    </message>
    <message>
        <source>Camera&apos;s transform:</source>
        <translation>Transformation:</translation>
    </message>
    <message>
        <source>A transform from the camera&apos;s axes (x along the columns, y down the rows, z toward the detector) to the patient; it is made by &apos;Use as initial camera&apos;.</source>
        <translation>Eine Transformation von den Achsen der Kamera (x entlang der Spalten, y die Zeilen hinab, z zum Detektor) zum Patienten; „Als Startkamera verwenden“ erzeugt sie.</translation>
    </message>
    <message>
        <source>None</source>
        <translation>Keine</translation>
    </message>
    <message>
        <source>Read geometry from a file...</source>
        <translation>Geometrie aus Datei...</translation>
    </message>
    <message>
        <source>Take distances, angles and the camera from a study file (JSON), for the X-ray of the same name or place in it.</source>
        <translation>Abstände, Winkel und die Kamera aus einer Studiendatei (JSON) übernehmen, für das Röntgenbild mit demselben Namen oder an derselben Stelle.</translation>
    </message>
    <message>
        <source>Clear entered geometry</source>
        <translation>Eingaben löschen</translation>
    </message>
    <message>
        <source>Use the values in the image&apos;s own file again.</source>
        <translation>Wieder die Werte aus der Datei des Bildes verwenden.</translation>
    </message>
    <message>
        <source>3. Initial cameras (optional)</source>
        <translation>3. Startkameras (optional)</translation>
    </message>
    <message>
        <source>Where the registration of the selected X-ray starts; it refines every camera that is not known exactly.</source>
        <translation>Wo die Registrierung des gewählten Röntgenbilds beginnt; sie verfeinert jede Kamera, die nicht genau bekannt ist.</translation>
    </message>
    <message>
        <source>Camera source:</source>
        <translation>Kameraquelle:</translation>
    </message>
    <message>
        <source>Where the initial camera of the selected X-ray comes from.</source>
        <translation>Woher die Startkamera des gewählten Röntgenbilds stammt.</translation>
    </message>
    <message>
        <source>Search near:</source>
        <translation>Suchen nahe:</translation>
    </message>
    <message>
        <source>The view as it was ordered; the search stays within 45 degrees of it. Position of the detector: AP behind the patient, PA in front, LL at the left side, RL at the right side.</source>
        <translation>Die Aufnahme, wie sie angeordnet war; die Suche bleibt innerhalb von 45 Grad davon. Lage des Detektors: AP hinter dem Patienten, PA vor ihm, LL an der linken Seite, RL an der rechten Seite.</translation>
    </message>
    <message>
        <source>Calibration:</source>
        <translation>Kalibrierung:</translation>
    </message>
    <message>
        <source>A calibrated camera: a 3x4 projection matrix (CSV or JSON), a MayaCam 2.0 text, or intrinsics with distortion (JSON). Its pose is used only when the calibration is the camera source; it must then be given in the CT&apos;s coordinates (LPS, mm).</source>
        <translation>Eine kalibrierte Kamera: eine 3x4-Projektionsmatrix (CSV oder JSON), ein Text von MayaCam 2.0 oder innere Parameter mit Verzeichnung (JSON). Ihre Lage wird nur verwendet, wenn die Kalibrierung die Kameraquelle ist; sie muss dann in den Koordinaten des CT angegeben sein (LPS, mm).</translation>
    </message>
    <message>
        <source>Camera model:</source>
        <translation>Kameramodell:</translation>
    </message>
    <message>
        <source>A model trained by python -m PolyPoseLib train on this CT and this anchor; models of other CTs are refused.</source>
        <translation>Ein Modell, das python -m PolyPoseLib train auf diesem CT und diesem Anker trainiert hat; Modelle anderer CTs werden abgelehnt.</translation>
    </message>
    <message>
        <source>Rig:</source>
        <translation>Messaufbau:</translation>
    </message>
    <message>
        <source>none: this camera is independent</source>
        <translation>keiner: Diese Kamera ist unabhängig</translation>
    </message>
    <message>
        <source>Name of the calibrated rig, such as a biplane stand, that took this X-ray. Give the same name to the other X-rays of the rig: their cameras keep the relative pose of their calibrations, and what is found for one places the others.</source>
        <translation>Name des kalibrierten Messaufbaus, etwa eines biplanaren Stativs, der dieses Röntgenbild aufgenommen hat. Geben Sie den übrigen Röntgenbildern des Aufbaus denselben Namen: Ihre Kameras behalten die relative Lage ihrer Kalibrierungen, und was für eine gefunden wird, legt die anderen fest.</translation>
    </message>
    <message>
        <source>Landmarks</source>
        <translation>Landmarken</translation>
    </message>
    <message>
        <source>Pick four or more points on the anchor, far apart and not in one line, in the CT and in the X-ray. Points with the same name form a pair.</source>
        <translation>Setzen Sie vier oder mehr Punkte auf dem Anker, weit voneinander entfernt und nicht auf einer Linie, im CT und im Röntgenbild. Punkte mit demselben Namen bilden ein Paar.</translation>
    </message>
    <message>
        <source>In the CT:</source>
        <translation>Im CT:</translation>
    </message>
    <message>
        <source>Points in the CT; X-rays may share a list.</source>
        <translation>Punkte im CT; Röntgenbilder können eine Liste teilen.</translation>
    </message>
    <message>
        <source>None yet</source>
        <translation>Noch keine</translation>
    </message>
    <message>
        <source>Pick</source>
        <translation>Setzen</translation>
    </message>
    <message>
        <source>Pick points in the slices or on the bones in 3D; press again, or click the right mouse button, to end.</source>
        <translation>Punkte in den Schichten oder auf den Knochen in 3D setzen; zum Beenden erneut drücken oder die rechte Maustaste klicken.</translation>
    </message>
    <message>
        <source>In the X-ray:</source>
        <translation>Im Röntgenbild:</translation>
    </message>
    <message>
        <source>Points in this X-ray; each X-ray has its own list.</source>
        <translation>Punkte in diesem Röntgenbild; jedes Röntgenbild hat seine eigene Liste.</translation>
    </message>
    <message>
        <source>Show the X-ray in its own view, and pick points there; press again, or click the right mouse button, to end.</source>
        <translation>Das Röntgenbild in seiner eigenen Ansicht zeigen und dort Punkte setzen; zum Beenden erneut drücken oder die rechte Maustaste klicken.</translation>
    </message>
    <message>
        <source>How far each landmark of the CT projects from its counterpart in the X-ray: in mm at its depth, and in pixels.</source>
        <translation>Wie weit jede Landmarke des CT von ihrem Gegenstück im Röntgenbild entfernt projiziert wird: in mm in ihrer Tiefe und in Pixeln.</translation>
    </message>
    <message>
        <source>Remove pair</source>
        <translation>Paar entfernen</translation>
    </message>
    <message>
        <source>Delete the selected landmark from both lists.</source>
        <translation>Die gewählte Landmarke aus beiden Listen löschen.</translation>
    </message>
    <message>
        <source>Find camera</source>
        <translation>Kamera finden</translation>
    </message>
    <message>
        <source>Find the camera of the selected X-ray; without it, the registration searches when it starts.</source>
        <translation>Die Kamera des gewählten Röntgenbilds finden; andernfalls sucht die Registrierung sie beim Start.</translation>
    </message>
    <message>
        <source>Find all</source>
        <translation>Alle finden</translation>
    </message>
    <message>
        <source>Find the camera of every X-ray that has none.</source>
        <translation>Die Kamera jedes Röntgenbilds finden, das keine hat.</translation>
    </message>
    <message>
        <source>Show</source>
        <translation>Anzeigen</translation>
    </message>
    <message>
        <source>Show the CT rendered by this camera over the X-ray, and the C-arm in 3D.</source>
        <translation>Das mit dieser Kamera gerenderte CT über dem Röntgenbild zeigen und den C-Bogen in 3D.</translation>
    </message>
    <message>
        <source>Accept</source>
        <translation>Übernehmen</translation>
    </message>
    <message>
        <source>Start the registration from this uncertain camera.</source>
        <translation>Die Registrierung mit dieser unsicheren Kamera beginnen.</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>Verwerfen</translation>
    </message>
    <message>
        <source>Discard the camera that was found.</source>
        <translation>Die gefundene Kamera verwerfen.</translation>
    </message>
    <message>
        <source>4. Place the C-arm (optional)</source>
        <translation>4. C-Bogen stellen (optional)</translation>
    </message>
    <message>
        <source>Move the sliders until the rendering of the CT lies on the X-ray. It need not be exact: the registration refines it.</source>
        <translation>Bewegen Sie die Regler, bis das Rendering des CT auf dem Röntgenbild liegt. Es muss nicht genau sein: Die Registrierung verfeinert es.</translation>
    </message>
    <message>
        <source>LAO + / RAO -:</source>
        <translation>LAO + / RAO -:</translation>
    </message>
    <message>
        <source>Primary angle; positive with the detector toward the patient&apos;s left.</source>
        <translation>Primärer Winkel; positiv, wenn der Detektor zur linken Seite des Patienten zeigt.</translation>
    </message>
    <message>
        <source> deg</source>
        <translation> °</translation>
    </message>
    <message>
        <source>CRA + / CAU -:</source>
        <translation>CRA + / CAU -:</translation>
    </message>
    <message>
        <source>Secondary angle; positive with the detector toward the head.</source>
        <translation>Sekundärer Winkel; positiv, wenn der Detektor zum Kopf zeigt.</translation>
    </message>
    <message>
        <source>Image rotation:</source>
        <translation>Bilddrehung:</translation>
    </message>
    <message>
        <source>Rotation of the detector about the beam.</source>
        <translation>Drehung des Detektors um den Strahl.</translation>
    </message>
    <message>
        <source>Source to isocentre:</source>
        <translation>Fokus-Isozentrum:</translation>
    </message>
    <message>
        <source>Distance from the source to the isocentre.</source>
        <translation>Abstand von der Röntgenquelle zum Isozentrum.</translation>
    </message>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>Source to detector:</source>
        <translation>Fokus-Detektor:</translation>
    </message>
    <message>
        <source>Distance from the source to the detector.</source>
        <translation>Abstand von der Röntgenquelle zum Detektor.</translation>
    </message>
    <message>
        <source>Table to the left:</source>
        <translation>Tisch nach links:</translation>
    </message>
    <message>
        <source>How far the patient lies to his or her left of the isocentre.</source>
        <translation>Wie weit der Patient, von ihm aus gesehen, links vom Isozentrum liegt.</translation>
    </message>
    <message>
        <source>Table to the front:</source>
        <translation>Tisch nach vorn:</translation>
    </message>
    <message>
        <source>How far the patient lies to the front of the isocentre.</source>
        <translation>Wie weit der Patient vor dem Isozentrum liegt (anterior).</translation>
    </message>
    <message>
        <source>Table to the head:</source>
        <translation>Tisch zum Kopf:</translation>
    </message>
    <message>
        <source>How far the patient lies toward the head from the isocentre.</source>
        <translation>Wie weit der Patient kopfwärts vom Isozentrum liegt.</translation>
    </message>
    <message>
        <source>Overlay:</source>
        <translation>Überlagerung:</translation>
    </message>
    <message>
        <source>How much of the rendering is seen over the X-ray.</source>
        <translation>Wie deutlich das Rendering über dem Röntgenbild zu sehen ist.</translation>
    </message>
    <message>
        <source> %</source>
        <translation> %</translation>
    </message>
    <message>
        <source>Show live</source>
        <translation>Live anzeigen</translation>
    </message>
    <message>
        <source>Render the CT over the selected X-ray while the sliders move.</source>
        <translation>Das CT über dem gewählten Röntgenbild rendern, während sich die Regler bewegen.</translation>
    </message>
    <message>
        <source>Back to what the X-ray&apos;s own geometry says.</source>
        <translation>Zurück zu dem, was die Geometrie des Röntgenbilds sagt.</translation>
    </message>
    <message>
        <source>Reset</source>
        <translation>Zurücksetzen</translation>
    </message>
    <message>
        <source>Use as initial camera</source>
        <translation>Als Startkamera verwenden</translation>
    </message>
    <message>
        <source>Start the registration of this X-ray from the camera that is shown.</source>
        <translation>Die Registrierung dieses Röntgenbilds mit der angezeigten Kamera beginnen.</translation>
    </message>
    <message>
        <source>5. Settings</source>
        <translation>5. Einstellungen</translation>
    </message>
    <message>
        <source>Preset:</source>
        <translation>Voreinstellung:</translation>
    </message>
    <message>
        <source>How thorough the registration is.</source>
        <translation>Wie gründlich die Registrierung ist.</translation>
    </message>
    <message>
        <source>Compute on:</source>
        <translation>Rechnen auf:</translation>
    </message>
    <message>
        <source>A graphics card is used when there is one, unless the processor is chosen.</source>
        <translation>Wenn es eine Grafikkarte gibt, wird sie verwendet, sofern nicht der Prozessor gewählt ist.</translation>
    </message>
    <message>
        <source>Show the curve of the similarity beside the slices.</source>
        <translation>Die Kurve der Ähnlichkeit neben den Schichten zeigen.</translation>
    </message>
    <message>
        <source>Show the similarity in the layout</source>
        <translation>Ähnlichkeit im Layout zeigen</translation>
    </message>
    <message>
        <source>Advanced</source>
        <translation>Erweitert</translation>
    </message>
    <message>
        <source>Update the slices while it runs</source>
        <translation>Schichten währenddessen aktualisieren</translation>
    </message>
    <message>
        <source>Refresh the transform while the registration runs.</source>
        <translation>Die Transformation auffrischen, während die Registrierung läuft.</translation>
    </message>
    <message>
        <source>Refine the cameras</source>
        <translation>Kameras verfeinern</translation>
    </message>
    <message>
        <source>Refine the cameras by aligning the anchor before the other bones move.</source>
        <translation>Die Kameras durch Anpassen des Ankers verfeinern, bevor sich die anderen Knochen bewegen.</translation>
    </message>
    <message>
        <source>Compute uncertainty</source>
        <translation>Unsicherheit berechnen</translation>
    </message>
    <message>
        <source>Estimate the uncertainty of each motion; takes a little longer.</source>
        <translation>Die Unsicherheit jeder Bewegung schätzen; dauert etwas länger.</translation>
    </message>
    <message>
        <source>Threads:</source>
        <translation>Threads:</translation>
    </message>
    <message>
        <source>Number of processor threads.</source>
        <translation>Anzahl der Prozessor-Threads.</translation>
    </message>
    <message>
        <source>all</source>
        <translation>alle</translation>
    </message>
    <message>
        <source>Random seed:</source>
        <translation>Zufallsstartwert:</translation>
    </message>
    <message>
        <source>The same seed gives the same result on the same machine.</source>
        <translation>Derselbe Startwert ergibt auf demselben Rechner dasselbe Ergebnis.</translation>
    </message>
    <message>
        <source>Keep the result folder in:</source>
        <translation>Ergebnisordner behalten in:</translation>
    </message>
    <message>
        <source>A new folder in which to keep result.json, the ITK transform and the images. Leave it empty to keep only the nodes in the scene.</source>
        <translation>Ein neuer Ordner für result.json, die ITK-Transformation und die Bilder. Leer lassen, um nur die Knoten der Szene zu behalten.</translation>
    </message>
    <message>
        <source>6. Review</source>
        <translation>6. Prüfen</translation>
    </message>
    <message>
        <source>Show PolyPose layout</source>
        <translation>PolyPose-Layout zeigen</translation>
    </message>
    <message>
        <source>X-rays in a row, the 3D view with the C-arms, and the three slices.</source>
        <translation>Röntgenbilder in einer Reihe, die 3D-Ansicht mit den C-Bögen und die drei Schichten.</translation>
    </message>
    <message>
        <source>Load result...</source>
        <translation>Ergebnis laden...</translation>
    </message>
    <message>
        <source>Open the folder of an earlier registration.</source>
        <translation>Den Ordner einer früheren Registrierung öffnen.</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>Compare</source>
        <translation>Vergleichen</translation>
    </message>
    <message>
        <source>CT and bones</source>
        <translation>CT und Knochen</translation>
    </message>
    <message>
        <source>Before (as in the CT)</source>
        <translation>Vorher (wie im CT)</translation>
    </message>
    <message>
        <source>Show the CT and its segmentation where they were scanned (Ctrl+Shift+B swaps).</source>
        <translation>Das CT und seine Segmentierung dort zeigen, wo sie aufgenommen wurden (Ctrl+Shift+B wechselt).</translation>
    </message>
    <message>
        <source>After (as in the X-rays)</source>
        <translation>Nachher (wie im Röntgenbild)</translation>
    </message>
    <message>
        <source>Show the CT and its segmentation in the posture of the X-rays, through the transform.</source>
        <translation>Das CT und seine Segmentierung durch die Transformation in der Haltung der Röntgenbilder zeigen.</translation>
    </message>
    <message>
        <source>Only the bones that move</source>
        <translation>Nur bewegte Knochen</translation>
    </message>
    <message>
        <source>Hide the segments that belong to no structure.</source>
        <translation>Die Segmente ausblenden, die zu keiner Struktur gehören.</translation>
    </message>
    <message>
        <source>Bones in 3D</source>
        <translation>Knochen in 3D</translation>
    </message>
    <message>
        <source>Show the bones that move as surfaces in the 3D view, where the chosen posture has them.</source>
        <translation>Die bewegten Knochen als Oberflächen in der 3D-Ansicht zeigen, so wie sie in der gewählten Haltung liegen.</translation>
    </message>
    <message>
        <source>X-ray versus rendering</source>
        <translation>Röntgenbild gegen Rendering</translation>
    </message>
    <message>
        <source>View:</source>
        <translation>Ansicht:</translation>
    </message>
    <message>
        <source>The X-ray to compare with its rendering.</source>
        <translation>Das Röntgenbild, das mit seinem Rendering verglichen wird.</translation>
    </message>
    <message>
        <source>Compare by:</source>
        <translation>Vergleichen durch:</translation>
    </message>
    <message>
        <source>How X-ray and rendering are shown in one image.</source>
        <translation>Wie Röntgenbild und Rendering in einem Bild gezeigt werden.</translation>
    </message>
    <message>
        <source>Blend</source>
        <translation>Überblenden</translation>
    </message>
    <message>
        <source>Checkerboard</source>
        <translation>Schachbrett</translation>
    </message>
    <message>
        <source>Flicker</source>
        <translation>Flackern</translation>
    </message>
    <message>
        <source>Edges of the rendering</source>
        <translation>Kanten des Renderings</translation>
    </message>
    <message>
        <source>X-ray alone</source>
        <translation>Nur Röntgenbild</translation>
    </message>
    <message>
        <source>Rendering alone</source>
        <translation>Nur Rendering</translation>
    </message>
    <message>
        <source>Amount:</source>
        <translation>Stärke:</translation>
    </message>
    <message>
        <source>Share of the rendering in a blend; size of the squares; strength of the edges.</source>
        <translation>Anteil des Renderings beim Überblenden; Größe der Felder; Stärke der Kanten.</translation>
    </message>
    <message>
        <source>Seen from the detector, as C-arms display</source>
        <translation>Vom Detektor gesehen, wie C-Bögen es zeigen</translation>
    </message>
    <message>
        <source>Off: as seen from the X-ray source.</source>
        <translation>Aus: von der Röntgenquelle gesehen.</translation>
    </message>
    <message>
        <source>Deformation</source>
        <translation>Deformation</translation>
    </message>
    <message>
        <source>Grid</source>
        <translation>Gitter</translation>
    </message>
    <message>
        <source>Show the deformation as a grid, in the slices.</source>
        <translation>Die Verformung als Gitter in den Schichten zeigen.</translation>
    </message>
    <message>
        <source>Show the deformation as arrows, in the slices and in 3D.</source>
        <translation>Die Verformung als Pfeile in den Schichten und in 3D zeigen.</translation>
    </message>
    <message>
        <source>Arrows</source>
        <translation>Pfeile</translation>
    </message>
    <message>
        <source>One row per X-ray: where its geometry comes from and how reliable it is. Image files, and loaded X-rays from a tree of the data, can be dropped here.</source>
        <translation>Eine Zeile je Röntgenbild: woher seine Geometrie stammt und wie verlässlich sie ist. Bilddateien und geladene Röntgenbilder aus einem Datenbaum können hierher gezogen werden.</translation>
    </message>
    <message>
        <source>Volume change</source>
        <translation>Volumenänderung</translation>
    </message>
    <message>
        <source>Show by colour where tissue grows or shrinks (Jacobian determinant); folds are marked.</source>
        <translation>Durch Farben zeigen, wo Gewebe wächst oder schrumpft (Jacobi-Determinante); Faltungen sind markiert.</translation>
    </message>
    <message>
        <source>Weight of:</source>
        <translation>Gewicht von:</translation>
    </message>
    <message>
        <source>Show how strongly a structure&apos;s motion influences each point.</source>
        <translation>Zeigen, wie stark die Bewegung einer Struktur jeden Punkt beeinflusst.</translation>
    </message>
    <message>
        <source>Motions</source>
        <translation>Bewegungen</translation>
    </message>
    <message>
        <source>Motions of the bones</source>
        <translation>Bewegungen der Knochen</translation>
    </message>
    <message>
        <source>Relative to:</source>
        <translation>Relativ zu:</translation>
    </message>
    <message>
        <source>Motions are shown as seen from this structure.</source>
        <translation>Bewegungen werden von dieser Struktur aus gesehen gezeigt.</translation>
    </message>
    <message>
        <source>Rotation, displacement of the centroid and axis of each structure, from the CT to the X-rays.</source>
        <translation>Drehung, Verschiebung des Schwerpunkts und Achse jeder Struktur, vom CT zu den Röntgenbildern.</translation>
    </message>
    <message>
        <source>Copy</source>
        <translation>Kopieren</translation>
    </message>
    <message>
        <source>Copy the table, ready to be pasted into a spreadsheet.</source>
        <translation>Die Tabelle kopieren, um sie in eine Tabellenkalkulation einzufügen.</translation>
    </message>
    <message>
        <source>Save as CSV...</source>
        <translation>Als CSV speichern...</translation>
    </message>
    <message>
        <source>Write the table into a file.</source>
        <translation>Die Tabelle in eine Datei schreiben.</translation>
    </message>
    <message>
        <source>Save report...</source>
        <translation>Bericht speichern...</translation>
    </message>
    <message>
        <source>Write one HTML page with inputs, motions, pictures and warnings.</source>
        <translation>Eine HTML-Seite mit Eingaben, Bewegungen, Bildern und Warnungen schreiben.</translation>
    </message>
    <message>
        <source>Save result as a scene...</source>
        <translation>Ergebnis als Szene speichern...</translation>
    </message>
    <message>
        <source>Write the CT, its segmentation and the result alone into a scene of their own (.mrb), which opens in any Slicer, without this module too.</source>
        <translation>Nur das CT, seine Segmentierung und das Ergebnis in eine eigene Szene (.mrb) schreiben, die sich in jedem Slicer öffnen lässt, auch ohne dieses Modul.</translation>
    </message>
    <message>
        <source>Carry</source>
        <translation>Mitnehmen</translation>
    </message>
    <message>
        <source>Carry along</source>
        <translation>Mitnehmen</translation>
    </message>
    <message>
        <source>Markups, models, segmentations, volumes and RT doses of the CT: what is checked follows Before and After, and the registration while it runs.</source>
        <translation>Markierungen, Modelle, Segmentierungen, Volumen und RT-Dosen des CT: Was angekreuzt ist, folgt Vorher und Nachher, und der Registrierung, während sie läuft.</translation>
    </message>
    <message>
        <source>95 % ellipsoids of points</source>
        <translation>95-%-Ellipsoide der Punkte</translation>
    </message>
    <message>
        <source>How far each carried point may be off, in 3D and in the slices; shown with After.</source>
        <translation>Wie weit jeder mitgenommene Punkt danebenliegen kann, in 3D und in den Schichten; mit Nachher gezeigt.</translation>
    </message>
    <message>
        <source>Result for planning systems</source>
        <translation>Ergebnis für Planungssysteme</translation>
    </message>
    <message>
        <source>Export as DICOM...</source>
        <translation>Als DICOM exportieren...</translation>
    </message>
    <message>
        <source>Write the warped CT, the segmentation, every bone&apos;s motion and the deformation as DICOM objects, for planning systems.</source>
        <translation>Das verformte CT, die Segmentierung, die Bewegung jedes Knochens und die Verformung als DICOM-Objekte für Planungssysteme schreiben.</translation>
    </message>
    <message>
        <source>Adjust</source>
        <translation>Anpassen</translation>
    </message>
    <message>
        <source>Bones moved by hand</source>
        <translation>Von Hand bewegte Knochen</translation>
    </message>
    <message>
        <source>The bone that the handles move.</source>
        <translation>Der Knochen, den die Griffe bewegen.</translation>
    </message>
    <message>
        <source>Show handles</source>
        <translation>Griffe zeigen</translation>
    </message>
    <message>
        <source>Show Slicer&apos;s handles on this bone, in 3D and in the slices, and its outline on the X-rays.</source>
        <translation>Die Griffe von Slicer an diesem Knochen zeigen, in 3D und in den Schichten, und seinen Umriss auf den Röntgenbildern.</translation>
    </message>
    <message>
        <source>Put back</source>
        <translation>Zurücksetzen</translation>
    </message>
    <message>
        <source>Put all bones back where the result has them.</source>
        <translation>Alle Knochen dorthin zurücksetzen, wo sie im Ergebnis liegen.</translation>
    </message>
    <message>
        <source>Refine from here</source>
        <translation>Von hier aus verfeinern</translation>
    </message>
    <message>
        <source>Fit cameras and bones again from where they are now; Undo brings this result back.</source>
        <translation>Kameras und Knochen von ihrem jetzigen Ort aus erneut einpassen; „Rückgängig“ bringt dieses Ergebnis zurück.</translation>
    </message>
    <message>
        <source>7. Motion</source>
        <translation>7. Bewegung</translation>
    </message>
    <message>
        <source>Frames per second:</source>
        <translation>Bilder pro Sekunde:</translation>
    </message>
    <message>
        <source>Of all cameras. Where it is left alone, it is what DICOM or the times of the images state.</source>
        <translation>Aller Kameras. Bleibt das Feld unberührt, gilt, was DICOM oder die Zeiten der Bilder angeben.</translation>
    </message>
    <message>
        <source>as the images state</source>
        <translation>wie in den Bildern angegeben</translation>
    </message>
    <message>
        <source>Frames:</source>
        <translation>Zeitpunkte:</translation>
    </message>
    <message>
        <source>The first frame that is tracked, counted from 0. Frame 0 is the first that all cameras have; the images that the X-rays show (Frame) belong together.</source>
        <translation>Der erste Zeitpunkt, der verfolgt wird, von 0 an gezählt. Zeitpunkt 0 ist der erste, den alle Kameras haben; die Bilder, die die Röntgenbilder zeigen (Bild), gehören zusammen.</translation>
    </message>
    <message>
        <source>to</source>
        <translation>bis</translation>
    </message>
    <message>
        <source>The last frame that is tracked.</source>
        <translation>Der letzte Zeitpunkt, der verfolgt wird.</translation>
    </message>
    <message>
        <source>Reference:</source>
        <translation>Bezug:</translation>
    </message>
    <message>
        <source>The structure relative to which the motion of the others is reported; it moves, too.</source>
        <translation>Die Struktur, relativ zu der die Bewegung der anderen angegeben wird; auch sie bewegt sich.</translation>
    </message>
    <message>
        <source>Start:</source>
        <translation>Beginn:</translation>
    </message>
    <message>
        <source>Where the bones are looked for in the first frame.</source>
        <translation>Wo die Knochen zum ersten Zeitpunkt gesucht werden.</translation>
    </message>
    <message>
        <source>Standing still:</source>
        <translation>Stehen still:</translation>
    </message>
    <message>
        <source>Structures that do not move during the sequence.</source>
        <translation>Strukturen, die sich während der Sequenz nicht bewegen.</translation>
    </message>
    <message>
        <source>Go back once more, and keep the better poses</source>
        <translation>Noch einmal rückwärts, bessere Lagen behalten</translation>
    </message>
    <message>
        <source>A second pass goes from the last frame to the first; it finds bones again that were lost behind others.</source>
        <translation>Ein zweiter Durchgang läuft vom letzten zum ersten Zeitpunkt; er findet Knochen wieder, die hinter anderen verloren gingen.</translation>
    </message>
    <message>
        <source>Smooth the poses</source>
        <translation>Lagen glätten</translation>
    </message>
    <message>
        <source>Smooth the poses with their own uncertainty. A smoothed track cannot be corrected afterwards.</source>
        <translation>Die Lagen mit ihrer eigenen Unsicherheit glätten. Eine geglättete Verfolgung lässt sich danach nicht korrigieren.</translation>
    </message>
    <message>
        <source>Track</source>
        <translation>Verfolgen</translation>
    </message>
    <message>
        <source>Go on</source>
        <translation>Fortsetzen</translation>
    </message>
    <message>
        <source>Go on with the frames that the interrupted tracking has left.</source>
        <translation>Mit den Zeitpunkten fortfahren, die die unterbrochene Verfolgung hinterlassen hat.</translation>
    </message>
    <message>
        <source>Tracked</source>
        <translation>Verfolgt</translation>
    </message>
    <message>
        <source>Previous doubtful</source>
        <translation>Voriger unsicherer</translation>
    </message>
    <message>
        <source>Go to the frame before this one whose poses are doubtful.</source>
        <translation>Zum Zeitpunkt davor gehen, dessen Lagen unsicher sind.</translation>
    </message>
    <message>
        <source>Next doubtful</source>
        <translation>Nächster unsicherer</translation>
    </message>
    <message>
        <source>Go to the frame after this one whose poses are doubtful.</source>
        <translation>Zum Zeitpunkt danach gehen, dessen Lagen unsicher sind.</translation>
    </message>
    <message>
        <source>The bone that is corrected.</source>
        <translation>Der Knochen, der korrigiert wird.</translation>
    </message>
    <message>
        <source>Correct</source>
        <translation>Korrigieren</translation>
    </message>
    <message>
        <source>Show handles on this bone: drag it until its outlines match the X-rays. It belongs to this frame, and is kept when you go to another one.</source>
        <translation>Griffe an diesem Knochen zeigen: ziehen, bis seine Umrisse zu den Röntgenbildern passen. Die Korrektur gehört zu diesem Zeitpunkt und bleibt erhalten, wenn ein anderer gezeigt wird.</translation>
    </message>
    <message>
        <source>Undo correction</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>Put the bone back where the track has it in this frame.</source>
        <translation>Den Knochen dorthin zurücksetzen, wo ihn die Verfolgung zu diesem Zeitpunkt hat.</translation>
    </message>
    <message>
        <source>Which frames are tracked anew from the corrected one on.</source>
        <translation>Welche Zeitpunkte vom korrigierten aus neu verfolgt werden.</translation>
    </message>
    <message>
        <source>Track on from here</source>
        <translation>Von hier aus weiter</translation>
    </message>
    <message>
        <source>Track anew from the bones that were corrected in this frame; other frames are kept.</source>
        <translation>Von den Knochen aus neu verfolgen, die zu diesem Zeitpunkt korrigiert wurden; andere Zeitpunkte bleiben.</translation>
    </message>
    <message>
        <source>Show plots</source>
        <translation>Diagramme zeigen</translation>
    </message>
    <message>
        <source>Show the X-rays with outlines, the bones, and plots of their motion.</source>
        <translation>Die Röntgenbilder mit Umrissen, die Knochen und Diagramme ihrer Bewegung zeigen.</translation>
    </message>
    <message>
        <source>Save track...</source>
        <translation>Verfolgung speichern...</translation>
    </message>
    <message>
        <source>Write the track into a folder, as the command line does.</source>
        <translation>Die Verfolgung in einen Ordner schreiben, wie es die Befehlszeile tut.</translation>
    </message>
    <message>
        <source>Register</source>
        <translation>Registrieren</translation>
    </message>
</context>
<context>
    <name>PolyPoseSlicer.calls</name>
    <message>
        <source>There is no result whose bones could be refined: register first.</source>
        <translation>Es gibt kein Ergebnis, dessen Knochen verfeinert werden könnten: Registrieren Sie zuerst.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is both an input and an output: choose another node for the output.</source>
        <translation>„{name}“ ist zugleich Eingabe und Ausgabe: Wählen Sie für die Ausgabe einen anderen Knoten.</translation>
    </message>
</context>
<context>
    <name>PolyPoseSlicer.samples</name>
    <message>
        <source>PolyPose simulates two X-rays of the sample...</source>
        <translation>PolyPose simuliert zwei Röntgenbilder des Beispiels...</translation>
    </message>
    <message>
        <source>{program} could not be started ({reason}): install Slicer again.</source>
        <translation>{program} konnte nicht gestartet werden ({reason}): Installieren Sie Slicer neu.</translation>
    </message>
</context>
<context>
    <name>panel.adjustment</name>
    <message>
        <source>Move a bone with the handles in 3D and in the slices: its outline on the X-rays follows. Then refine: all bones are fitted from where they are, and none is looked for elsewhere.</source>
        <translation>Bewegen Sie einen Knochen mit den Griffen in 3D und in den Schichten: Sein Umriss auf den Röntgenbildern folgt. Dann verfeinern Sie: Alle Knochen werden von ihrem Ort aus eingepasst, und keiner wird anderswo gesucht.</translation>
    </message>
    <message>
        <source>Bones can be adjusted once there is a result.</source>
        <translation>Knochen können angepasst werden, sobald es ein Ergebnis gibt.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; has no voxel in the warped segmentation: register again, or choose another bone.</source>
        <translation>„{name}“ hat kein Voxel in der verformten Segmentierung: Registrieren Sie erneut, oder wählen Sie einen anderen Knochen.</translation>
    </message>
</context>
<context>
    <name>panel.camera_text</name>
    <message>
        <source>No other view scores nearly as high.</source>
        <translation>Keine andere Ansicht wird annähernd so gut bewertet.</translation>
    </message>
    <message>
        <source>This X-ray is not ready: complete its geometry above.</source>
        <translation>Dieses Röntgenbild ist nicht bereit: Vervollständigen Sie oben seine Geometrie.</translation>
    </message>
    <message>
        <source>The pose in the calibration is used; it must be given in the CT&apos;s coordinates (LPS, mm).</source>
        <translation>Die Lage aus der Kalibrierung wird verwendet; sie muss in den Koordinaten des CT angegeben sein (LPS, mm).</translation>
    </message>
    <message>
        <source>Its file gives no angles: choose another camera source.</source>
        <translation>Die Datei enthält keine Winkel: Wählen Sie eine andere Kameraquelle.</translation>
    </message>
    <message>
        <source>Choose the model file; python -m PolyPoseLib train makes one for this CT.</source>
        <translation>Wählen Sie die Modelldatei; python -m PolyPoseLib train erzeugt eine für dieses CT.</translation>
    </message>
    <message>
        <source>Not searched for yet: press Find camera, or the registration will search when it starts.</source>
        <translation>Noch nicht gesucht: Klicken Sie auf „Kamera finden“, sonst sucht die Registrierung beim Start.</translation>
    </message>
    <message>
        <source>Found: {how}.</source>
        <translation>Gefunden: {how}.</translation>
    </message>
    <message>
        <source>Expected accuracy: {degrees:.0f} deg and {mm:.0f} mm.</source>
        <translation>Erwartete Genauigkeit: {degrees:.0f}° und {mm:.0f} mm.</translation>
    </message>
    <message>
        <source>It is uncertain, and in use because you accepted it.</source>
        <translation>Sie ist unsicher und wird verwendet, weil Sie sie übernommen haben.</translation>
    </message>
    <message>
        <source>It is uncertain and not in use: show it, then accept or discard it.</source>
        <translation>Sie ist unsicher und wird nicht verwendet: Zeigen Sie sie an, dann übernehmen oder verwerfen Sie sie.</translation>
    </message>
    <message>
        <source>Choose the calibration file.</source>
        <translation>Wählen Sie die Kalibrierdatei.</translation>
    </message>
</context>
<context>
    <name>panel.cameras</name>
    <message>
        <source>Find camera</source>
        <translation>Kamera finden</translation>
    </message>
    <message>
        <source>all directions</source>
        <translation>alle Richtungen</translation>
    </message>
    <message>
        <source>Calibration files</source>
        <translation>Kalibrierdateien</translation>
    </message>
    <message>
        <source>All files</source>
        <translation>Alle Dateien</translation>
    </message>
    <message>
        <source>Every X-ray already has an initial camera.</source>
        <translation>Jedes Röntgenbild hat bereits eine Startkamera.</translation>
    </message>
    <message>
        <source>{count} found.</source>
        <translation>{count} gefunden.</translation>
    </message>
    <message>
        <source>X-rays that you changed meanwhile were left as they are.</source>
        <translation>Röntgenbilder, die Sie inzwischen geändert haben, blieben, wie sie waren.</translation>
    </message>
    <message>
        <source>Preparing the data...</source>
        <translation>Daten werden vorbereitet...</translation>
    </message>
    <message>
        <source>Select an X-ray in the table.</source>
        <translation>Wählen Sie ein Röntgenbild in der Tabelle.</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Wird abgebrochen...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Stop the search; nothing is changed.</source>
        <translation>Die Suche beenden; nichts wird geändert.</translation>
    </message>
    <message>
        <source>This camera source needs no search.</source>
        <translation>Diese Kameraquelle braucht keine Suche.</translation>
    </message>
    <message>
        <source>Choose the model file.</source>
        <translation>Wählen Sie die Modelldatei.</translation>
    </message>
    <message>
        <source>Find the camera of the selected X-ray.</source>
        <translation>Die Kamera des gewählten Röntgenbilds finden.</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Abgebrochen; nichts wurde geändert.</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>Wird gestartet...</translation>
    </message>
    <message>
        <source>Camera of {name}</source>
        <translation>Kamera von {name}</translation>
    </message>
    <message>
        <source>{count} uncertain and not in use: select the X-ray and review it.</source>
        <translation>{count} unsicher und nicht verwendet: Wählen Sie das Röntgenbild und prüfen Sie die Kamera.</translation>
    </message>
    <message>
        <source>{stage}: {iteration} of {of}</source>
        <translation>{stage}: {iteration} von {of}</translation>
    </message>
</context>
<context>
    <name>panel.carm</name>
    <message>
        <source>Preparing the CT...</source>
        <translation>CT wird vorbereitet...</translation>
    </message>
    <message>
        <source>The registration of &apos;{name}&apos; will start from this camera.</source>
        <translation>Die Registrierung von „{name}“ wird mit dieser Kamera beginnen.</translation>
    </message>
    <message>
        <source>Choose the CT first.</source>
        <translation>Wählen Sie zuerst das CT.</translation>
    </message>
    <message>
        <source>Select an X-ray that is ready.</source>
        <translation>Wählen Sie ein Röntgenbild, das bereit ist.</translation>
    </message>
    <message>
        <source>Live ({milliseconds:.0f} ms per image).</source>
        <translation>Live ({milliseconds:.0f} ms je Bild).</translation>
    </message>
    <message>
        <source>Initial camera of {name}</source>
        <translation>Startkamera von {name}</translation>
    </message>
</context>
<context>
    <name>panel.carry</name>
    <message>
        <source>Is put under the result&apos;s transform while After is shown, and back for Before.</source>
        <translation>Kommt unter die Transformation des Ergebnisses, solange Nachher gezeigt wird, und für Vorher zurück.</translation>
    </message>
    <message>
        <source>Computing...</source>
        <translation>Wird berechnet...</translation>
    </message>
    <message>
        <source>Points inside a bone take the bone&apos;s own motion; all others, the displacement field. The markups themselves stay as they are: copies of them are shown.</source>
        <translation>Punkte in einem Knochen bewegen sich mit diesem, alle anderen mit dem Verschiebungsfeld. Die Markierungen selbst bleiben, wie sie sind: Gezeigt werden Kopien.</translation>
    </message>
    <message>
        <source>Nothing to carry: load or make markups, models, segmentations or volumes of the CT.</source>
        <translation>Nichts mitzunehmen: Laden oder erstellen Sie Markierungen, Modelle, Segmentierungen oder Volumen des CT.</translation>
    </message>
    <message>
        <source>Points follow the displacement field alone: {reason}</source>
        <translation>Die Punkte folgen allein dem Verschiebungsfeld: {reason}</translation>
    </message>
    <message>
        <source>Check what shall follow Before and After.</source>
        <translation>Kreuzen Sie an, was Vorher und Nachher folgen soll.</translation>
    </message>
    <message>
        <source>Choose After in the tab Compare to see it in the posture of the X-rays.</source>
        <translation>Wählen Sie Nachher auf der Karteikarte Vergleichen, um es in der Haltung der Röntgenbilder zu sehen.</translation>
    </message>
    <message>
        <source>Shown in the posture of the X-rays.</source>
        <translation>In der Haltung der Röntgenbilder gezeigt.</translation>
    </message>
</context>
<context>
    <name>panel.export</name>
    <message>
        <source>Added to Slicer&apos;s DICOM database.</source>
        <translation>In die DICOM-Datenbank von Slicer aufgenommen.</translation>
    </message>
    <message>
        <source>Writing DICOM...</source>
        <translation>DICOM wird geschrieben...</translation>
    </message>
    <message>
        <source>Export as DICOM...</source>
        <translation>Als DICOM exportieren...</translation>
    </message>
    <message>
        <source>Export as DICOM into a folder</source>
        <translation>Als DICOM in einen Ordner exportieren</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Abgebrochen; nichts wurde geändert.</translation>
    </message>
    <message>
        <source>Add the exported DICOM objects to Slicer&apos;s DICOM database?</source>
        <translation>Die exportierten DICOM-Objekte in die DICOM-Datenbank von Slicer aufnehmen?</translation>
    </message>
    <message>
        <source>Stop the export; nothing is written.</source>
        <translation>Den Export abbrechen; nichts wird geschrieben.</translation>
    </message>
    <message>
        <source>Write the warped CT, the segmentation, every bone&apos;s motion and the deformation as DICOM objects, for planning systems.</source>
        <translation>Das verformte CT, die Segmentierung, die Bewegung jedes Knochens und die Verformung als DICOM-Objekte für Planungssysteme schreiben.</translation>
    </message>
    <message>
        <source>Written to {folder}.</source>
        <translation>Nach {folder} geschrieben.</translation>
    </message>
    <message>
        <source>Export as DICOM</source>
        <translation>Als DICOM exportieren</translation>
    </message>
    <message>
        <source>Slicer&apos;s DICOM module could not add them ({reason}): add the folder there.</source>
        <translation>Das DICOM-Modul von Slicer konnte sie nicht aufnehmen ({reason}): Fügen Sie den Ordner dort hinzu.</translation>
    </message>
    <message>
        <source>The CT is not in Slicer&apos;s DICOM database: everything, the CT too, was written for the placeholder patient {name}.</source>
        <translation>Das CT ist nicht in der DICOM-Datenbank von Slicer: Alles, auch das CT, wurde für den Platzhalter-Patienten {name} geschrieben.</translation>
    </message>
</context>
<context>
    <name>panel.landmark_table</name>
    <message>
        <source>Landmark</source>
        <translation>Landmarke</translation>
    </message>
    <message>
        <source>Error [mm]</source>
        <translation>Fehler [mm]</translation>
    </message>
    <message>
        <source>Error [px]</source>
        <translation>Fehler [px]</translation>
    </message>
    <message>
        <source>State</source>
        <translation>Zustand</translation>
    </message>
    <message>
        <source>only in the CT</source>
        <translation>nur im CT</translation>
    </message>
    <message>
        <source>only in the X-ray</source>
        <translation>nur im Röntgenbild</translation>
    </message>
    <message>
        <source>not on the X-ray</source>
        <translation>nicht auf dem Röntgenbild</translation>
    </message>
    <message>
        <source>pending</source>
        <translation>ausstehend</translation>
    </message>
    <message>
        <source>used</source>
        <translation>verwendet</translation>
    </message>
    <message>
        <source>excluded: inconsistent with the others</source>
        <translation>ausgeschlossen: passt nicht zu den anderen</translation>
    </message>
</context>
<context>
    <name>panel.landmarks</name>
    <message>
        <source>Slicer has no main window to show the views in.</source>
        <translation>Slicer hat kein Hauptfenster, in dem die Ansichten erscheinen könnten.</translation>
    </message>
    <message>
        <source>{name}: landmarks in the CT</source>
        <translation>{name}: Landmarken im CT</translation>
    </message>
    <message>
        <source>{name}: landmarks in the X-ray</source>
        <translation>{name}: Landmarken im Röntgenbild</translation>
    </message>
    <message>
        <source>projected landmarks</source>
        <translation>projizierte Landmarken</translation>
    </message>
    <message>
        <source>Camera of {name} by landmarks</source>
        <translation>Kamera von {name} aus Landmarken</translation>
    </message>
    <message>
        <source>Only the first {count} X-rays can be shown: remove another one first.</source>
        <translation>Nur die ersten {count} Röntgenbilder können angezeigt werden: Entfernen Sie zuerst ein anderes.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is already used by another X-ray or by the CT: each X-ray needs a list of its own.</source>
        <translation>„{name}“ wird schon von einem anderen Röntgenbild oder vom CT verwendet: Jedes Röntgenbild braucht eine eigene Liste.</translation>
    </message>
    <message>
        <source>{name}: pixels</source>
        <translation>{name}: Pixel</translation>
    </message>
</context>
<context>
    <name>panel.maps</name>
    <message>
        <source>Computing...</source>
        <translation>Wird berechnet...</translation>
    </message>
    <message>
        <source>nothing</source>
        <translation>nichts</translation>
    </message>
    <message>
        <source>Black: &apos;{name}&apos; has no influence; yellow: only &apos;{name}&apos; has.</source>
        <translation>Schwarz: „{name}“ hat keinen Einfluss; gelb: nur „{name}“ hat Einfluss.</translation>
    </message>
</context>
<context>
    <name>panel.motions</name>
    <message>
        <source>Displacement [mm]</source>
        <translation>Verschiebung [mm]</translation>
    </message>
    <message>
        <source>Rotation [deg]</source>
        <translation>Drehung [deg]</translation>
    </message>
    <message>
        <source>Right [mm]</source>
        <translation>Rechts [mm]</translation>
    </message>
    <message>
        <source>Anterior [mm]</source>
        <translation>Anterior [mm]</translation>
    </message>
    <message>
        <source>Superior [mm]</source>
        <translation>Superior [mm]</translation>
    </message>
    <message>
        <source>Axis (R, A, S)</source>
        <translation>Achse (R, A, S)</translation>
    </message>
    <message>
        <source>Uncertainty</source>
        <translation>Unsicherheit</translation>
    </message>
    <message>
        <source>Doubts</source>
        <translation>Zweifel</translation>
    </message>
    <message>
        <source>Structure</source>
        <translation>Struktur</translation>
    </message>
    <message>
        <source>Save motions</source>
        <translation>Bewegungen speichern</translation>
    </message>
    <message>
        <source>Tables (*.csv)</source>
        <translation>Tabellen (*.csv)</translation>
    </message>
    <message>
        <source>the CT (absolute)</source>
        <translation>dem CT (absolut)</translation>
    </message>
    <message>
        <source>Relative to {name}</source>
        <translation>Relativ zu {name}</translation>
    </message>
    <message>
        <source>{path} cannot be written ({reason}): choose another folder.</source>
        <translation>{path} kann nicht geschrieben werden ({reason}): Wählen Sie einen anderen Ordner.</translation>
    </message>
</context>
<context>
    <name>panel.register</name>
    <message>
        <source>Register</source>
        <translation>Registrieren</translation>
    </message>
    <message>
        <source>Preparing the data...</source>
        <translation>Daten werden vorbereitet...</translation>
    </message>
    <message>
        <source>Reading the result...</source>
        <translation>Ergebnis wird gelesen...</translation>
    </message>
    <message>
        <source>Done in {seconds:.0f} s on {device}.</source>
        <translation>Fertig in {seconds:.0f} s auf {device}.</translation>
    </message>
    <message>
        <source>PolyPose similarity</source>
        <translation>PolyPose Ähnlichkeit</translation>
    </message>
    <message>
        <source>PolyPose similarity curve</source>
        <translation>PolyPose Ähnlichkeitskurve</translation>
    </message>
    <message>
        <source>PolyPose similarity plot</source>
        <translation>PolyPose Ähnlichkeitsdiagramm</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Wird abgebrochen...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Stop the registration; nothing is changed.</source>
        <translation>Die Registrierung beenden; nichts wird geändert.</translation>
    </message>
    <message>
        <source>Align the CT to the X-rays.</source>
        <translation>Das CT an die Röntgenbilder anpassen.</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Abgebrochen; nichts wurde geändert.</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>Wird gestartet...</translation>
    </message>
    <message>
        <source>this computer</source>
        <translation>diesem Computer</translation>
    </message>
    <message>
        <source>Ready: {bones} structures, {xrays} X-rays.</source>
        <translation>Bereit: {bones} Strukturen, {xrays} Röntgenbilder.</translation>
    </message>
</context>
<context>
    <name>panel.report_page</name>
    <message>
        <source>PolyPose report</source>
        <translation>PolyPose-Bericht</translation>
    </message>
    <message>
        <source>Research software, not for clinical decisions.</source>
        <translation>Forschungssoftware, nicht für klinische Entscheidungen.</translation>
    </message>
    <message>
        <source>Do not trust this result: {why}</source>
        <translation>Verlassen Sie sich nicht auf dieses Ergebnis: {why}</translation>
    </message>
    <message>
        <source>X-rays and renderings</source>
        <translation>Röntgenbilder und Renderings</translation>
    </message>
    <message>
        <source>Summary</source>
        <translation>Zusammenfassung</translation>
    </message>
    <message>
        <source>Motions of the bones</source>
        <translation>Bewegungen der Knochen</translation>
    </message>
</context>
<context>
    <name>panel.review</name>
    <message>
        <source>No result yet: register, or load an earlier result.</source>
        <translation>Noch kein Ergebnis: Registrieren Sie, oder laden Sie ein früheres Ergebnis.</translation>
    </message>
    <message>
        <source>all</source>
        <translation>alle</translation>
    </message>
    <message>
        <source>Slicer has no main window to show the views in.</source>
        <translation>Slicer hat kein Hauptfenster, in dem die Ansichten erscheinen könnten.</translation>
    </message>
    <message>
        <source>Load a result folder</source>
        <translation>Ergebnisordner laden</translation>
    </message>
</context>
<context>
    <name>panel.saving</name>
    <message>
        <source>Save report</source>
        <translation>Bericht speichern</translation>
    </message>
    <message>
        <source>HTML pages (*.html)</source>
        <translation>HTML-Seiten (*.html)</translation>
    </message>
    <message>
        <source>Save result as a scene</source>
        <translation>Ergebnis als Szene speichern</translation>
    </message>
    <message>
        <source>Scenes (*.mrb)</source>
        <translation>Szenen (*.mrb)</translation>
    </message>
    <message>
        <source>{voxels} voxels of {spacing} mm</source>
        <translation>{voxels} Voxel von {spacing} mm</translation>
    </message>
    <message>
        <source>CT</source>
        <translation>CT</translation>
    </message>
    <message>
        <source>Structures</source>
        <translation>Strukturen</translation>
    </message>
    <message>
        <source>Anchor</source>
        <translation>Anker</translation>
    </message>
    <message>
        <source>Preset</source>
        <translation>Voreinstellung</translation>
    </message>
    <message>
        <source>Computed on</source>
        <translation>Berechnet auf</translation>
    </message>
    <message>
        <source>Computing time [s]</source>
        <translation>Rechenzeit [s]</translation>
    </message>
    <message>
        <source>X-ray</source>
        <translation>Röntgenbild</translation>
    </message>
    <message>
        <source>rendering</source>
        <translation>Rendering</translation>
    </message>
    <message>
        <source>edges</source>
        <translation>Kanten</translation>
    </message>
    <message>
        <source>{path} cannot be written ({reason}): choose another folder.</source>
        <translation>{path} kann nicht geschrieben werden ({reason}): Wählen Sie einen anderen Ordner.</translation>
    </message>
    <message>
        <source>similarity {n:.4f}</source>
        <translation>Ähnlichkeit {n:.4f}</translation>
    </message>
</context>
<context>
    <name>panel.segment_bones</name>
    <message>
        <source>starting</source>
        <translation>startet</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Wird abgebrochen...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Stop the segmentation; nothing is changed.</source>
        <translation>Die Segmentierung anhalten; nichts wird verändert.</translation>
    </message>
    <message>
        <source>{name} could not segment the CT ({reason}): see the application&apos;s log.</source>
        <translation>{name} konnte das CT nicht segmentieren ({reason}): siehe das Protokoll der Anwendung.</translation>
    </message>
    <message>
        <source>Segment bones</source>
        <translation>Segmentieren</translation>
    </message>
    <message>
        <source>{name} ended with the code {code}: see the application&apos;s log.</source>
        <translation>{name} endete mit dem Code {code}: siehe das Protokoll der Anwendung.</translation>
    </message>
    <message>
        <source>{name} is installing what it needs...</source>
        <translation>{name} installiert, was es braucht...</translation>
    </message>
    <message>
        <source>The CT was deleted meanwhile: choose another.</source>
        <translation>Das CT wurde inzwischen gelöscht: Wählen Sie ein anderes.</translation>
    </message>
    <message>
        <source>{ct} bones</source>
        <translation>{ct} Knochen</translation>
    </message>
    <message>
        <source>Segmented with {name}: check the bones and their structures.</source>
        <translation>Mit {name} segmentiert: Prüfen Sie die Knochen und ihre Strukturen.</translation>
    </message>
    <message>
        <source>Segment the CT with the extension TotalSegmentator or MONAIAuto3DSeg, and propose the structures.</source>
        <translation>Das CT mit der Erweiterung TotalSegmentator oder MONAIAuto3DSeg segmentieren und die Strukturen vorschlagen.</translation>
    </message>
    <message>
        <source>Choose the CT first.</source>
        <translation>Wählen Sie zuerst das CT.</translation>
    </message>
    <message>
        <source>{name} found nothing in &apos;{ct}&apos;: is it a CT in Hounsfield units?</source>
        <translation>{name} fand nichts in „{ct}“: Ist es ein CT in Hounsfield-Einheiten?</translation>
    </message>
    <message>
        <source>&apos;{node}&apos; is ready; another CT is chosen by now.</source>
        <translation>„{node}“ ist fertig; inzwischen ist ein anderes CT gewählt.</translation>
    </message>
    <message>
        <source>{name}: {line}</source>
        <translation>{name}: {line}</translation>
    </message>
    <message>
        <source>The extension cannot be loaded ({reason}): update it.</source>
        <translation>Die Erweiterung kann nicht geladen werden ({reason}): Aktualisieren Sie sie.</translation>
    </message>
</context>
<context>
    <name>panel.stage_words</name>
    <message>
        <source>Saving the result...</source>
        <translation>Ergebnis wird gespeichert...</translation>
    </message>
    <message>
        <source>Saving the track...</source>
        <translation>Die Verfolgung wird gespeichert...</translation>
    </message>
    <message>
        <source>Tracking: {frame} of {of} frames</source>
        <translation>Verfolgung: {frame} von {of} Zeitpunkten</translation>
    </message>
    <message>
        <source>Back: {frame} of {of} frames</source>
        <translation>Rückweg: {frame} von {of} Zeitpunkten</translation>
    </message>
    <message>
        <source>Preparing the CT</source>
        <translation>CT wird vorbereitet</translation>
    </message>
    <message>
        <source>Fitting the bones</source>
        <translation>Knochen werden eingepasst</translation>
    </message>
    <message>
        <source>Looking for better places of bones</source>
        <translation>Bessere Lagen der Knochen werden gesucht</translation>
    </message>
    <message>
        <source>Looking at united bones one by one</source>
        <translation>Vereinte Knochen werden einzeln betrachtet</translation>
    </message>
    <message>
        <source>Estimating the uncertainty</source>
        <translation>Unsicherheit wird geschätzt</translation>
    </message>
    <message>
        <source>Warping the CT</source>
        <translation>CT wird verformt</translation>
    </message>
    <message>
        <source>Rendering the X-rays</source>
        <translation>Röntgenbilder werden gerendert</translation>
    </message>
    <message>
        <source>{stage}: {iteration} of {of}</source>
        <translation>{stage}: {iteration} von {of}</translation>
    </message>
    <message>
        <source>about {minutes:.0f} min left in this pass</source>
        <translation>noch etwa {minutes:.0f} min in diesem Durchgang</translation>
    </message>
    <message>
        <source>, similarity {similarity:.4f}</source>
        <translation>, Ähnlichkeit {similarity:.4f}</translation>
    </message>
    <message>
        <source>about {seconds:.0f} s left in this pass</source>
        <translation>noch etwa {seconds:.0f} s in diesem Durchgang</translation>
    </message>
    <message>
        <source>Camera of {name}</source>
        <translation>Kamera von {name}</translation>
    </message>
</context>
<context>
    <name>panel.structures</name>
    <message>
        <source>No segment has the name of a bone, such as femur_left or &apos;Left femur&apos;: rename the segments, or type the structures into the table.</source>
        <translation>Kein Segment trägt den Namen eines Knochens, etwa femur_left oder &apos;Left femur&apos;: Benennen Sie die Segmente um, oder tragen Sie die Strukturen in die Tabelle ein.</translation>
    </message>
    <message>
        <source>Choose a CT and its segmentation; every bone needs a segment.</source>
        <translation>Wählen Sie ein CT und seine Segmentierung; jeder Knochen braucht ein Segment.</translation>
    </message>
    <message>
        <source>No segment is included yet: propose structures, or check segments in the table.</source>
        <translation>Noch ist kein Segment einbezogen: Lassen Sie Strukturen vorschlagen, oder haken Sie Segmente in der Tabelle an.</translation>
    </message>
    <message>
        <source>Segment (moves)</source>
        <translation>Segment (bewegt sich)</translation>
    </message>
    <message>
        <source>Structure</source>
        <translation>Struktur</translation>
    </message>
    <message>
        <source>Anchor</source>
        <translation>Anker</translation>
    </message>
    <message>
        <source>Checked: this segment moves as a bone.</source>
        <translation>Angehakt: Dieses Segment bewegt sich als Knochen.</translation>
    </message>
    <message>
        <source>Moving relative to the anchor, &apos;{anchor}&apos;: {names}.</source>
        <translation>Bewegen sich relativ zum Anker, „{anchor}“: {names}.</translation>
    </message>
    <message>
        <source>anchor</source>
        <translation>Anker</translation>
    </message>
    <message>
        <source>{count} structures; now check the anchor, which stays where it is.</source>
        <translation>{count} Strukturen; prüfen Sie jetzt den Anker, der an seinem Ort bleibt.</translation>
    </message>
    <message>
        <source>Only the anchor, &apos;{anchor}&apos;, is included: the cameras will be found, and no bone moves.</source>
        <translation>Nur der Anker, „{anchor}“, ist einbezogen: Die Kameras werden gefunden, und kein Knochen bewegt sich.</translation>
    </message>
</context>
<context>
    <name>panel.track_review</name>
    <message>
        <source>forward and backward</source>
        <translation>vorwärts und rückwärts</translation>
    </message>
    <message>
        <source>forward</source>
        <translation>vorwärts</translation>
    </message>
    <message>
        <source>backward</source>
        <translation>rückwärts</translation>
    </message>
    <message>
        <source>Saving the track...</source>
        <translation>Die Verfolgung wird gespeichert...</translation>
    </message>
    <message>
        <source>Save the track into a folder</source>
        <translation>Verfolgung in einem Ordner speichern</translation>
    </message>
    <message>
        <source>A smoothed track cannot be continued: track without smoothing first.</source>
        <translation>Eine geglättete Verfolgung lässt sich nicht fortsetzen: zuerst ohne Glättung verfolgen.</translation>
    </message>
    <message>
        <source>{count} doubtful frames in this direction.</source>
        <translation>{count} unsichere Zeitpunkte in dieser Richtung.</translation>
    </message>
    <message>
        <source>The scene has the poses alone: tables and plots of joints are left out.</source>
        <translation>Die Szene enthält nur die Lagen: Tabellen und Diagramme der Gelenke fehlen.</translation>
    </message>
    <message>
        <source>Corrections are not in it before you track on from them.</source>
        <translation>Korrekturen sind erst darin, wenn von ihnen aus weiter verfolgt wurde.</translation>
    </message>
    <message>
        <source>Track anew from the bones of this frame, as you have corrected them; other frames are kept.</source>
        <translation>Von den Knochen dieses Zeitpunkts aus neu verfolgen, wie sie korrigiert wurden; andere Zeitpunkte bleiben.</translation>
    </message>
    <message>
        <source>The track could not be written: {reason}</source>
        <translation>Die Verfolgung konnte nicht geschrieben werden: {reason}</translation>
    </message>
    <message>
        <source>Written to {folder}.</source>
        <translation>Nach {folder} geschrieben.</translation>
    </message>
</context>
<context>
    <name>panel.track_words</name>
    <message>
        <source>Look at the outlines on the X-rays all the same.</source>
        <translation>Trotzdem die Umrisse auf den Röntgenbildern ansehen.</translation>
    </message>
    <message>
        <source>What to do: correct a doubtful frame and track on from there, or give better cameras.</source>
        <translation>Was zu tun ist: einen unsicheren Zeitpunkt korrigieren und von dort aus weiter verfolgen, oder bessere Kameras angeben.</translation>
    </message>
    <message>
        <source>The checks found no sign of failure</source>
        <translation>Die Prüfungen fanden kein Anzeichen eines Fehlschlags</translation>
    </message>
    <message>
        <source>{frames} frames are tracked, in {seconds:.0f} s.</source>
        <translation>{frames} Zeitpunkte wurden in {seconds:.0f} s verfolgt.</translation>
    </message>
    <message>
        <source>DO NOT TRUST THIS TRACK</source>
        <translation>DIESER VERFOLGUNG NICHT TRAUEN</translation>
    </message>
    <message>
        <source>Check the doubtful frames before you use the track</source>
        <translation>Vor der Verwendung die unsicheren Zeitpunkte prüfen</translation>
    </message>
    <message>
        <source>{name}: {count} images; frame 0 is image {first}.</source>
        <translation>{name}: {count} Bilder; zu Zeitpunkt 0 gehört Bild {first}.</translation>
    </message>
    <message>
        <source>{name}: {doubtful} doubtful frames, lost in {lost} of them.</source>
        <translation>{name}: {doubtful} unsichere Zeitpunkte, davon {lost} verloren.</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>Warnung: {text}</translation>
    </message>
    <message>
        <source>Frame {number}</source>
        <translation>Zeitpunkt {number}</translation>
    </message>
    <message>
        <source>Why: {why}</source>
        <translation>Grund: {why}</translation>
    </message>
    <message>
        <source>Corrected by hand: {names}.</source>
        <translation>Von Hand korrigiert: {names}.</translation>
    </message>
    <message>
        <source>{name} was lost.</source>
        <translation>{name} ging verloren.</translation>
    </message>
    <message>
        <source>{name} is doubtful: {why}.</source>
        <translation>{name} ist unsicher: {why}.</translation>
    </message>
</context>
<context>
    <name>panel.tracking</name>
    <message>
        <source>Preparing the data...</source>
        <translation>Daten werden vorbereitet...</translation>
    </message>
    <message>
        <source>Track</source>
        <translation>Verfolgen</translation>
    </message>
    <message>
        <source>Reading the track...</source>
        <translation>Die Verfolgung wird gelesen...</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Wird abgebrochen...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Stop the tracking; frames that are done are kept.</source>
        <translation>Die Verfolgung anhalten; fertige Zeitpunkte bleiben erhalten.</translation>
    </message>
    <message>
        <source>Follow the bones through the sequences.</source>
        <translation>Den Knochen durch die Sequenzen folgen.</translation>
    </message>
    <message>
        <source>{count} frames of an interrupted tracking are kept: Go on continues after them.

Begin anew all the same? They are removed once the new tracking has frames of its own.</source>
        <translation>{count} Zeitpunkte einer unterbrochenen Verfolgung sind erhalten: mit Fortsetzen geht es danach weiter.

Trotzdem neu beginnen? Sie werden entfernt, sobald die neue Verfolgung eigene Zeitpunkte hat.</translation>
    </message>
    <message>
        <source>Cancelled.</source>
        <translation>Abgebrochen.</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Abgebrochen; nichts wurde geändert.</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>Wird gestartet...</translation>
    </message>
    <message>
        <source>The finished track is in {folder} until the scene is closed.</source>
        <translation>Die fertige Verfolgung liegt in {folder}, bis die Szene geschlossen wird.</translation>
    </message>
    <message>
        <source>{count} frames are kept: press Go on to continue after them, as long as the inputs stay as they are.</source>
        <translation>{count} Zeitpunkte sind erhalten: mit Fortsetzen geht es danach weiter, solange die Eingaben gleich bleiben.</translation>
    </message>
    <message>
        <source>Ready: {bones} structures, {cameras} cameras, frames {first} to {last}, {rate:.4g} a second.</source>
        <translation>Bereit: {bones} Strukturen, {cameras} Kameras, Zeitpunkte {first} bis {last}, {rate:.4g} pro Sekunde.</translation>
    </message>
</context>
<context>
    <name>panel.undo</name>
    <message>
        <source>Redo</source>
        <translation>Wiederholen</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>Brings back what was there before the last registration.</source>
        <translation>Bringt zurück, was vor der letzten Registrierung da war.</translation>
    </message>
    <message>
        <source>Bring back the result of the last registration.</source>
        <translation>Das Ergebnis der letzten Registrierung zurückbringen.</translation>
    </message>
    <message>
        <source>Take the result of the last registration out of the scene; Redo brings it back.</source>
        <translation>Das Ergebnis der letzten Registrierung aus der Szene nehmen; „Wiederholen“ bringt es zurück.</translation>
    </message>
    <message>
        <source>Bring back the result that was there before the last registration.</source>
        <translation>Das Ergebnis zurückbringen, das vor der letzten Registrierung da war.</translation>
    </message>
</context>
<context>
    <name>panel.verdict</name>
    <message>
        <source>Look at the overlay of each X-ray all the same.</source>
        <translation>Sehen Sie sich trotzdem die Überlagerung jedes Röntgenbilds an.</translation>
    </message>
    <message>
        <source>What to do: look at the overlay of each X-ray; where it does not match, give a better initial camera or landmarks, and register again.</source>
        <translation>Was zu tun ist: Sehen Sie sich die Überlagerung jedes Röntgenbilds an; wo sie nicht passt, geben Sie eine bessere Startkamera oder Landmarken vor und registrieren Sie erneut.</translation>
    </message>
    <message>
        <source>The checks found no sign of failure</source>
        <translation>Die Prüfungen fanden kein Anzeichen eines Fehlschlags</translation>
    </message>
    <message>
        <source>DO NOT TRUST THIS RESULT</source>
        <translation>VERLASSEN SIE SICH NICHT AUF DIESES ERGEBNIS</translation>
    </message>
    <message>
        <source>Check what is named here before you use the result</source>
        <translation>Prüfen Sie das hier Genannte, bevor Sie das Ergebnis verwenden</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>Warnung: {text}</translation>
    </message>
    <message>
        <source>Why: {why}</source>
        <translation>Grund: {why}</translation>
    </message>
</context>
<context>
    <name>panel.xray_details</name>
    <message>
        <source>as in the file</source>
        <translation>wie in der Datei</translation>
    </message>
    <message>
        <source>&apos;{text}&apos; is not a number: use digits and a decimal point, or leave the field empty.</source>
        <translation>„{text}“ ist keine Zahl: Verwenden Sie Ziffern und einen Dezimalpunkt, oder lassen Sie das Feld leer.</translation>
    </message>
</context>
<context>
    <name>panel.xray_drop</name>
    <message>
        <source>drop image files, or loaded X-rays (a volume, a sequence, or a folder of them) from a tree of the data</source>
        <translation>ziehen Sie Bilddateien oder geladene Röntgenbilder (ein Volumen, eine Sequenz oder einen Ordner davon) aus einem Datenbaum hierher</translation>
    </message>
    <message>
        <source>No X-ray: {names}; {can}.</source>
        <translation>Kein Röntgenbild: {names}; {can}.</translation>
    </message>
    <message>
        <source>Nothing here is an X-ray: {can}.</source>
        <translation>Nichts davon ist ein Röntgenbild: {can}.</translation>
    </message>
    <message>
        <source>{names} and {count} more</source>
        <translation>{names} und {count} weitere</translation>
    </message>
</context>
<context>
    <name>panel.xrays</name>
    <message>
        <source>Add two or more X-rays from different directions.</source>
        <translation>Fügen Sie zwei oder mehr Röntgenbilder aus verschiedenen Richtungen hinzu.</translation>
    </message>
    <message>
        <source>X-ray</source>
        <translation>Röntgenbild</translation>
    </message>
    <message>
        <source>Geometry from</source>
        <translation>Geometrie aus</translation>
    </message>
    <message>
        <source>Camera</source>
        <translation>Kamera</translation>
    </message>
    <message>
        <source>State</source>
        <translation>Zustand</translation>
    </message>
    <message>
        <source>X-rays</source>
        <translation>Röntgenbilder</translation>
    </message>
    <message>
        <source>All files</source>
        <translation>Alle Dateien</translation>
    </message>
    <message>
        <source>Read geometry</source>
        <translation>Geometrie lesen</translation>
    </message>
    <message>
        <source>Study files (*.json)</source>
        <translation>Studiendateien (*.json)</translation>
    </message>
    <message>
        <source>What was dropped is in the table already.</source>
        <translation>Was hierher gezogen wurde, steht schon in der Tabelle.</translation>
    </message>
    <message>
        <source>Add X-rays</source>
        <translation>Röntgenbilder hinzufügen</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is not ready: complete its geometry, or remove it.</source>
        <translation>Das Röntgenbild „{name}“ ist nicht bereit: Vervollständigen Sie seine Geometrie, oder entfernen Sie es.</translation>
    </message>
</context>
<context>
    <name>process.camera_run</name>
    <message>
        <source>search</source>
        <translation>Suche</translation>
    </message>
    <message>
        <source>The result of the search cannot be read: search again.</source>
        <translation>Das Ergebnis der Suche kann nicht gelesen werden: Suchen Sie erneut.</translation>
    </message>
</context>
<context>
    <name>process.dependencies</name>
    <message>
        <source>PyTorch is missing, and nothing is installed while testing.</source>
        <translation>PyTorch fehlt, und beim Testen wird nichts installiert.</translation>
    </message>
    <message>
        <source>PyTorch was not installed: PolyPose cannot register without it.</source>
        <translation>PyTorch wurde nicht installiert: Ohne PyTorch kann PolyPose nicht registrieren.</translation>
    </message>
    <message>
        <source>PyTorch is missing: install the extension PyTorch in the Extensions Manager and restart Slicer.</source>
        <translation>PyTorch fehlt: Installieren Sie die Erweiterung PyTorch im Erweiterungsmanager, und starten Sie Slicer neu.</translation>
    </message>
    <message>
        <source>The Python packages that PolyPose needs were not installed ({reason}): try again.</source>
        <translation>Die Python-Pakete, die PolyPose braucht, wurden nicht installiert ({reason}): Versuchen Sie es erneut.</translation>
    </message>
    <message>
        <source>PyTorch could not be installed ({reason}): install it in the module PyTorch Utils.</source>
        <translation>PyTorch konnte nicht installiert werden ({reason}): Installieren Sie es im Modul PyTorch Utils.</translation>
    </message>
</context>
<context>
    <name>process.dicom_export</name>
    <message>
        <source>DICOM export</source>
        <translation>DICOM-Export</translation>
    </message>
</context>
<context>
    <name>process.environment</name>
    <message>
        <source>PolyPose needs 3D Slicer {needed} or newer, and this is {found}: install the current stable version.</source>
        <translation>PolyPose braucht 3D Slicer {needed} oder neuer, und dies ist {found}: Installieren Sie die aktuelle stabile Version.</translation>
    </message>
</context>
<context>
    <name>process.extensions</name>
    <message>
        <source>Bones are segmented by the extension TotalSegmentator or MONAIAuto3DSeg: install one in the Extensions Manager and restart Slicer.</source>
        <translation>Knochen segmentiert die Erweiterung TotalSegmentator oder MONAIAuto3DSeg: Installieren Sie eine davon im Extensions Manager und starten Sie Slicer neu.</translation>
    </message>
    <message>
        <source>Bones are segmented by an extension, and neither TotalSegmentator nor MONAIAuto3DSeg is installed.

Install {name} now, with the extensions that it needs? It is downloaded from Slicer&apos;s extensions server.</source>
        <translation>Knochen segmentiert eine Erweiterung, und weder TotalSegmentator noch MONAIAuto3DSeg ist installiert.

{name} jetzt installieren, mit den Erweiterungen, die es braucht? Es wird vom Erweiterungsserver von Slicer heruntergeladen.</translation>
    </message>
    <message>
        <source>{name} was installed: save your data and restart Slicer.</source>
        <translation>{name} wurde installiert: Speichern Sie Ihre Daten und starten Sie Slicer neu.</translation>
    </message>
    <message>
        <source>The extension {name} is installed, but its module is not loaded: restart Slicer, or enable it in the Extensions Manager.</source>
        <translation>Die Erweiterung {name} ist installiert, aber ihr Modul ist nicht geladen: Starten Sie Slicer neu oder aktivieren Sie sie im Extensions Manager.</translation>
    </message>
    <message>
        <source>The extension {name} could not be installed: check the network connection, or install it in the Extensions Manager.</source>
        <translation>Die Erweiterung {name} konnte nicht installiert werden: Prüfen Sie die Netzwerkverbindung oder installieren Sie sie im Extensions Manager.</translation>
    </message>
    <message>
        <source>{name} was installed. Slicer must be restarted before it can be used; data that were not saved are lost. Restart now?</source>
        <translation>{name} wurde installiert. Slicer muss neu gestartet werden, bevor es benutzt werden kann; nicht gespeicherte Daten gehen verloren. Jetzt neu starten?</translation>
    </message>
</context>
<context>
    <name>process.monai_auto3dseg</name>
    <message>
        <source>MONAIAuto3DSeg offers no model of bones: update the extension.</source>
        <translation>MONAIAuto3DSeg bietet kein Modell für Knochen: Aktualisieren Sie die Erweiterung.</translation>
    </message>
    <message>
        <source>computing</source>
        <translation>rechnet</translation>
    </message>
    <message>
        <source>MONAIAuto3DSeg ended with the code {code}: see the application&apos;s log.</source>
        <translation>MONAIAuto3DSeg endete mit dem Code {code}: siehe das Protokoll der Anwendung.</translation>
    </message>
    <message>
        <source>MONAIAuto3DSeg&apos;s result could not be read: see the application&apos;s log.</source>
        <translation>Das Ergebnis von MONAIAuto3DSeg konnte nicht gelesen werden: siehe das Protokoll der Anwendung.</translation>
    </message>
    <message>
        <source>reading the result</source>
        <translation>liest das Ergebnis</translation>
    </message>
</context>
<context>
    <name>process.registration</name>
    <message>
        <source>registration</source>
        <translation>Registrierung</translation>
    </message>
    <message>
        <source>The result must not be trusted: {reasons}.</source>
        <translation>Das Ergebnis ist nicht verlässlich: {reasons}.</translation>
    </message>
    <message>
        <source>{name} transform</source>
        <translation>{name}: Transformation</translation>
    </message>
</context>
<context>
    <name>process.render_client</name>
    <message>
        <source>The CT cannot be rendered ({reason}): choose the CT again to retry.</source>
        <translation>Das CT kann nicht gerendert werden ({reason}): Wählen Sie das CT noch einmal, um es erneut zu versuchen.</translation>
    </message>
    <message>
        <source>its process ended</source>
        <translation>der Prozess wurde beendet</translation>
    </message>
    <message>
        <source>The rendering cannot be read: {reason}.</source>
        <translation>Das Rendering kann nicht gelesen werden: {reason}.</translation>
    </message>
</context>
<context>
    <name>process.segmentation_task</name>
    <message>
        <source>The segmentation was cancelled; nothing was changed.</source>
        <translation>Die Segmentierung wurde abgebrochen; nichts wurde verändert.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; was deleted while the CT was segmented: start the segmentation again.</source>
        <translation>„{name}“ wurde gelöscht, während das CT segmentiert wurde: Starten Sie die Segmentierung erneut.</translation>
    </message>
</context>
<context>
    <name>process.study_run</name>
    <message>
        <source>registration</source>
        <translation>Registrierung</translation>
    </message>
    <message>
        <source>a crash</source>
        <translation>ein Absturz</translation>
    </message>
    <message>
        <source>Memory ran out: crop the CT or use a coarser one.</source>
        <translation>Der Speicher reichte nicht: Beschneiden Sie das CT, oder verwenden Sie ein gröberes.</translation>
    </message>
    <message>
        <source>The {what} ended without a result (exit status {status}).</source>
        <translation>Die {what} endete ohne Ergebnis (Rückgabewert {status}).</translation>
    </message>
    <message>
        <source>signal {number}</source>
        <translation>Signal {number}</translation>
    </message>
    <message>
        <source>The {what} was cancelled.</source>
        <translation>Die {what} wurde abgebrochen.</translation>
    </message>
    <message>
        <source>The {what} was interrupted from outside.</source>
        <translation>Die {what} wurde von außen unterbrochen.</translation>
    </message>
    <message>
        <source>The {what}&apos;s process was ended by the system ({end}), most often because memory ran out: use the fast preset, or crop the CT.</source>
        <translation>Der Prozess der {what} wurde vom System beendet ({end}), meist weil der Speicher nicht reichte: Verwenden Sie die schnelle Voreinstellung, oder beschneiden Sie das CT.</translation>
    </message>
    <message>
        <source>The Python package &apos;{name}&apos; is missing: let PolyPose install what it needs.</source>
        <translation>Das Python-Paket „{name}“ fehlt: Lassen Sie PolyPose installieren, was es braucht.</translation>
    </message>
    <message>
        <source>The {what} rejected its input without giving a reason.</source>
        <translation>Die {what} hat ihre Eingabe ohne Angabe eines Grundes zurückgewiesen.</translation>
    </message>
    <message>
        <source>{program} could not be started ({reason}): install Slicer again.</source>
        <translation>{program} konnte nicht gestartet werden ({reason}): Installieren Sie Slicer neu.</translation>
    </message>
    <message>
        <source>An unexpected error occurred: {fault}.</source>
        <translation>Ein unerwarteter Fehler trat auf: {fault}.</translation>
    </message>
</context>
<context>
    <name>process.track_run</name>
    <message>
        <source>tracking</source>
        <translation>Verfolgung</translation>
    </message>
    <message>
        <source>The track must not be trusted: {reasons}.</source>
        <translation>Der Verfolgung ist nicht zu trauen: {reasons}.</translation>
    </message>
</context>
<context>
    <name>scene.bone_handles</name>
    <message>
        <source>Adjustment of {name}</source>
        <translation>Anpassung von {name}</translation>
    </message>
    <message>
        <source>{name}, adjusted</source>
        <translation>{name}, angepasst</translation>
    </message>
    <message>
        <source>Outline of {name}</source>
        <translation>Umriss von {name}</translation>
    </message>
</context>
<context>
    <name>scene.bone_models</name>
    <message>
        <source>Motion of {name}</source>
        <translation>Bewegung von {name}</translation>
    </message>
    <message>
        <source>{name} in 3D</source>
        <translation>{name} in 3D</translation>
    </message>
</context>
<context>
    <name>scene.cameras</name>
    <message>
        <source>The camera &apos;{name}&apos; is not a linear transform: choose one that is.</source>
        <translation>Die Kamera „{name}“ ist keine lineare Transformation: Wählen Sie eine lineare.</translation>
    </message>
</context>
<context>
    <name>scene.carried_nodes</name>
    <message>
        <source>{name} carried along</source>
        <translation>{name} mitgenommen</translation>
    </message>
</context>
<context>
    <name>scene.carried_points</name>
    <message>
        <source>{name} as X-rayed</source>
        <translation>{name} wie in den Röntgenbildern</translation>
    </message>
</context>
<context>
    <name>scene.deformation</name>
    <message>
        <source>PolyPose volume change</source>
        <translation>PolyPose Volumenänderung</translation>
    </message>
    <message>
        <source>PolyPose volume change colours</source>
        <translation>PolyPose Farben der Volumenänderung</translation>
    </message>
    <message>
        <source>PolyPose weight</source>
        <translation>PolyPose Gewicht</translation>
    </message>
    <message>
        <source>PolyPose weight colours</source>
        <translation>PolyPose Farben des Gewichts</translation>
    </message>
    <message>
        <source>Volume changes by a factor of {low:.2f} to {high:.2f} (99 % of the grid).</source>
        <translation>Das Volumen ändert sich um den Faktor {low:.2f} bis {high:.2f} (99 % des Gitters).</translation>
    </message>
    <message>
        <source>The deformation folds in {share:.2f} % of the grid (magenta): do not trust the soft tissue there.</source>
        <translation>Die Deformation faltet sich in {share:.2f} % des Gitters (magenta): Verlassen Sie sich dort nicht auf die Weichteile.</translation>
    </message>
    <message>
        <source>PolyPose weight of {name}</source>
        <translation>PolyPose Gewicht von {name}</translation>
    </message>
    <message>
        <source>No folds.</source>
        <translation>Keine Faltungen.</translation>
    </message>
    <message>
        <source>There is no structure &apos;{name}&apos;: choose one from the table.</source>
        <translation>Es gibt keine Struktur „{name}“: Wählen Sie eine aus der Tabelle.</translation>
    </message>
</context>
<context>
    <name>scene.ellipsoids</name>
    <message>
        <source>95 % ellipsoids of carried points</source>
        <translation>95-%-Ellipsoide mitgenommener Punkte</translation>
    </message>
</context>
<context>
    <name>scene.grid_transform</name>
    <message>
        <source>&apos;{node}&apos; does not hold a displacement grid: register first, or load a result.</source>
        <translation>„{node}“ enthält kein Verschiebungsgitter: Registrieren Sie zuerst, oder laden Sie ein Ergebnis.</translation>
    </message>
</context>
<context>
    <name>scene.motions</name>
    <message>
        <source>Structure</source>
        <translation>Struktur</translation>
    </message>
    <message>
        <source>Rotation [deg]</source>
        <translation>Drehung [deg]</translation>
    </message>
    <message>
        <source>Displacement [mm]</source>
        <translation>Verschiebung [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % along the beam [mm]</source>
        <translation>{percent:.0f} % längs des Strahls [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % across the beam [mm]</source>
        <translation>{percent:.0f} % quer zum Strahl [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % about the beam [deg]</source>
        <translation>{percent:.0f} % um den Strahl [deg]</translation>
    </message>
    <message>
        <source>{percent:.0f} % across the beam [deg]</source>
        <translation>{percent:.0f} % quer zum Strahl [deg]</translation>
    </message>
    <message>
        <source>Right [mm]</source>
        <translation>Rechts [mm]</translation>
    </message>
    <message>
        <source>Anterior [mm]</source>
        <translation>Anterior [mm]</translation>
    </message>
    <message>
        <source>Superior [mm]</source>
        <translation>Superior [mm]</translation>
    </message>
    <message>
        <source>Axis R</source>
        <translation>Achse R</translation>
    </message>
    <message>
        <source>Axis A</source>
        <translation>Achse A</translation>
    </message>
    <message>
        <source>Axis S</source>
        <translation>Achse S</translation>
    </message>
    <message>
        <source>Doubts</source>
        <translation>Zweifel</translation>
    </message>
</context>
<context>
    <name>scene.nodes</name>
    <message>
        <source>The volume &apos;{name}&apos; has no voxels: load it again.</source>
        <translation>Das Volumen „{name}“ hat keine Voxel: Laden Sie es erneut.</translation>
    </message>
    <message>
        <source>The segmentation &apos;{name}&apos; has no segment &apos;{segment}&apos;.</source>
        <translation>Die Segmentierung „{name}“ hat kein Segment „{segment}“.</translation>
    </message>
    <message>
        <source>The segmentation &apos;{name}&apos; cannot be converted to label maps.</source>
        <translation>Die Segmentierung „{name}“ kann nicht in Labelkarten umgewandelt werden.</translation>
    </message>
</context>
<context>
    <name>scene.track_charts</name>
    <message>
        <source>angle [deg]</source>
        <translation>Winkel [deg]</translation>
    </message>
    <message>
        <source>translation [mm]</source>
        <translation>Verschiebung [mm]</translation>
    </message>
    <message>
        <source>time [s]</source>
        <translation>Zeit [s]</translation>
    </message>
    <message>
        <source>{joint} angles</source>
        <translation>{joint}: Winkel</translation>
    </message>
    <message>
        <source>{joint} angles, doubtful</source>
        <translation>{joint}: Winkel, zweifelhaft</translation>
    </message>
    <message>
        <source>{joint} angles, this frame</source>
        <translation>{joint}: Winkel, dieses Bild</translation>
    </message>
    <message>
        <source>{joint} translations</source>
        <translation>{joint}: Verschiebungen</translation>
    </message>
    <message>
        <source>{joint} translations, doubtful</source>
        <translation>{joint}: Verschiebungen, zweifelhaft</translation>
    </message>
    <message>
        <source>{joint} translations, this frame</source>
        <translation>{joint}: Verschiebungen, dieses Bild</translation>
    </message>
    <message>
        <source>{title}, values</source>
        <translation>{title}, Werte</translation>
    </message>
    <message>
        <source>{title}, intervals</source>
        <translation>{title}, Intervalle</translation>
    </message>
    <message>
        <source>{quantity}, 95 %</source>
        <translation>{quantity}, 95 %</translation>
    </message>
    <message>
        <source>{title}, cursor</source>
        <translation>{title}, Zeiger</translation>
    </message>
    <message>
        <source>{title}, doubtful frames</source>
        <translation>{title}, zweifelhafte Bilder</translation>
    </message>
</context>
<context>
    <name>scene.track_outlines</name>
    <message>
        <source>Outline of {bone} on {xray}</source>
        <translation>Umriss von {bone} auf {xray}</translation>
    </message>
</context>
<context>
    <name>scene.track_sequences</name>
    <message>
        <source>&apos;{name}&apos; holds no images: choose a sequence of X-rays, or a volume.</source>
        <translation>„{name}“ enthält keine Bilder: Wählen Sie eine Sequenz von Röntgenbildern oder ein Volumen.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is not an image: choose a volume or a sequence of volumes.</source>
        <translation>„{name}“ ist kein Bild: Wählen Sie ein Volumen oder eine Sequenz von Volumen.</translation>
    </message>
</context>
<context>
    <name>scene.xray_views</name>
    <message>
        <source>View of {name}</source>
        <translation>Ansicht von {name}</translation>
    </message>
    <message>
        <source>C-arm of {name}</source>
        <translation>C-Bogen von {name}</translation>
    </message>
    <message>
        <source>Detector of {name}</source>
        <translation>Detektor von {name}</translation>
    </message>
</context>
<context>
    <name>study.camera_source</name>
    <message>
        <source>automatic: the best available</source>
        <translation>automatisch: die beste verfügbare</translation>
    </message>
    <message>
        <source>C-arm placed by hand</source>
        <translation>von Hand gestellter C-Bogen</translation>
    </message>
    <message>
        <source>DICOM angles</source>
        <translation>DICOM-Winkel</translation>
    </message>
    <message>
        <source>landmarks</source>
        <translation>Landmarken</translation>
    </message>
    <message>
        <source>search</source>
        <translation>Suche</translation>
    </message>
    <message>
        <source>model trained on this CT</source>
        <translation>auf diesem CT trainiertes Modell</translation>
    </message>
    <message>
        <source>calibrated camera</source>
        <translation>kalibrierte Kamera</translation>
    </message>
</context>
<context>
    <name>study.carried_points</name>
    <message>
        <source>Points moved by the bone in which they lie: {count}.</source>
        <translation>Mit ihrem Knochen bewegte Punkte: {count}.</translation>
    </message>
    <message>
        <source>Points moved by the displacement field: {count}.</source>
        <translation>Mit dem Verschiebungsfeld bewegte Punkte: {count}.</translation>
    </message>
    <message>
        <source>Points outside of the result&apos;s grid, which are only roughly right: {count}.</source>
        <translation>Punkte außerhalb des Gitters des Ergebnisses, die nur ungefähr stimmen: {count}.</translation>
    </message>
    <message>
        <source>The longest half axes of the 95 % ellipsoids: {least:.1f} to {most:.1f} mm.</source>
        <translation>Die längsten Halbachsen der 95-%-Ellipsoide: {least:.1f} bis {most:.1f} mm.</translation>
    </message>
    <message>
        <source>Points whose uncertainty is not known: {count}.</source>
        <translation>Punkte, deren Unsicherheit nicht bekannt ist: {count}.</translation>
    </message>
</context>
<context>
    <name>study.field_words</name>
    <message>
        <source>set &quot;{field}&quot; to &quot;{choice}&quot;</source>
        <translation>stellen Sie „{field}“ auf „{choice}“</translation>
    </message>
    <message>
        <source>Source to detector</source>
        <translation>Fokus-Detektor</translation>
    </message>
    <message>
        <source>Source to isocentre</source>
        <translation>Fokus-Isozentrum</translation>
    </message>
    <message>
        <source>Pixel spacing</source>
        <translation>Pixelabstand</translation>
    </message>
    <message>
        <source>Principal point</source>
        <translation>Hauptpunkt</translation>
    </message>
    <message>
        <source>LAO + / RAO -</source>
        <translation>LAO + / RAO -</translation>
    </message>
    <message>
        <source>CRA + / CAU -</source>
        <translation>CRA + / CAU -</translation>
    </message>
    <message>
        <source>Isocentre</source>
        <translation>Isozentrum</translation>
    </message>
    <message>
        <source>Patient position</source>
        <translation>Patientenlagerung</translation>
    </message>
    <message>
        <source>Search near</source>
        <translation>Suchen nahe</translation>
    </message>
    <message>
        <source>Camera pose</source>
        <translation>Kameralage</translation>
    </message>
    <message>
        <source>Image seen from</source>
        <translation>Bild gesehen von</translation>
    </message>
    <message>
        <source>the source</source>
        <translation>der Röntgenquelle</translation>
    </message>
    <message>
        <source>Distortion</source>
        <translation>Verzeichnung</translation>
    </message>
    <message>
        <source>corrected</source>
        <translation>korrigiert</translation>
    </message>
</context>
<context>
    <name>study.landmark_fit</name>
    <message>
        <source>The landmarks</source>
        <translation>Die Landmarken</translation>
    </message>
    <message>
        <source>Only in the CT: {names}.</source>
        <translation>Nur im CT: {names}.</translation>
    </message>
    <message>
        <source>Only in the X-ray: {names}.</source>
        <translation>Nur im Röntgenbild: {names}.</translation>
    </message>
    <message>
        <source>Not on the X-ray: {names}; pick them in the X-ray&apos;s own view.</source>
        <translation>Nicht auf dem Röntgenbild: {names}; setzen Sie sie in der eigenen Ansicht des Röntgenbilds.</translation>
    </message>
    <message>
        <source>{used} of {count} landmarks used, RMS error {rms:.1f} mm; expected accuracy of the camera: {degrees:.1f} deg and {mm:.0f} mm.</source>
        <translation>{used} von {count} Landmarken verwendet, RMS-Fehler {rms:.1f} mm; erwartete Genauigkeit der Kamera: {degrees:.1f}° und {mm:.0f} mm.</translation>
    </message>
    <message>
        <source>Uncertain: {why}.</source>
        <translation>Unsicher: {why}.</translation>
    </message>
    <message>
        <source>{count} of at least {fewest} pairs: pick {missing} more, on the anchor.</source>
        <translation>{count} von mindestens {fewest} Paaren: Setzen Sie {missing} weitere, auf dem Anker.</translation>
    </message>
</context>
<context>
    <name>study.parameters</name>
    <message>
        <source>Choose the CT.</source>
        <translation>Wählen Sie das CT.</translation>
    </message>
    <message>
        <source>Choose the segmentation of the CT&apos;s bones.</source>
        <translation>Wählen Sie die Segmentierung der Knochen des CT.</translation>
    </message>
    <message>
        <source>Assign at least one segment to a structure, or have the structures proposed.</source>
        <translation>Ordnen Sie mindestens ein Segment einer Struktur zu, oder lassen Sie die Strukturen vorschlagen.</translation>
    </message>
    <message>
        <source>Choose the anchor: the structure that stays where it is.</source>
        <translation>Wählen Sie den Anker: die Struktur, die an ihrem Ort bleibt.</translation>
    </message>
    <message>
        <source>Add an X-ray; two or more from different directions are better.</source>
        <translation>Fügen Sie ein Röntgenbild hinzu; zwei oder mehr aus verschiedenen Richtungen sind besser.</translation>
    </message>
    <message>
        <source>Default</source>
        <translation>Standard</translation>
    </message>
    <message>
        <source>Fast (for a first look)</source>
        <translation>Schnell (für einen ersten Eindruck)</translation>
    </message>
    <message>
        <source>Paper (the published settings)</source>
        <translation>Artikel (die veröffentlichten Einstellungen)</translation>
    </message>
    <message>
        <source>Automatic</source>
        <translation>Automatisch</translation>
    </message>
    <message>
        <source>Processor (CPU)</source>
        <translation>Prozessor (CPU)</translation>
    </message>
    <message>
        <source>Graphics card (GPU, CUDA)</source>
        <translation>Grafikkarte (GPU, CUDA)</translation>
    </message>
    <message>
        <source>The rig &quot;{name}&quot; has only one X-ray: enter it for another X-ray as well, or clear it.</source>
        <translation>Der Messaufbau „{name}“ hat nur ein Röntgenbild: Tragen Sie ihn auch bei einem anderen ein, oder löschen Sie ihn.</translation>
    </message>
</context>
<context>
    <name>study.reader</name>
    <message>
        <source>{path}: there is no such file; correct the study.</source>
        <translation>{path}: Diese Datei gibt es nicht; berichtigen Sie die Studie.</translation>
    </message>
</context>
<context>
    <name>study.result_scene</name>
    <message>
        <source>{path} cannot be written: choose another folder.</source>
        <translation>{path} kann nicht geschrieben werden: Wählen Sie einen anderen Ordner.</translation>
    </message>
</context>
<context>
    <name>study.results</name>
    <message>
        <source>{name} transform</source>
        <translation>{name}: Transformation</translation>
    </message>
    <message>
        <source>{name} warped CT</source>
        <translation>{name}: verformtes CT</translation>
    </message>
    <message>
        <source>{name} warped segmentation</source>
        <translation>{name}: verformte Segmentierung</translation>
    </message>
    <message>
        <source>{name} motions</source>
        <translation>{name}: Bewegungen</translation>
    </message>
    <message>
        <source>{name} similarity</source>
        <translation>{name}: Ähnlichkeit</translation>
    </message>
    <message>
        <source>{name} similarity curve</source>
        <translation>{name}: Ähnlichkeitskurve</translation>
    </message>
    <message>
        <source>{name} similarity plot</source>
        <translation>{name}: Ähnlichkeitsdiagramm</translation>
    </message>
    <message>
        <source>Similarity</source>
        <translation>Ähnlichkeit</translation>
    </message>
    <message>
        <source>Iteration</source>
        <translation>Iteration</translation>
    </message>
    <message>
        <source>Label {number}</source>
        <translation>Label {number}</translation>
    </message>
    <message>
        <source>view {number}</source>
        <translation>Ansicht {number}</translation>
    </message>
</context>
<context>
    <name>study.scene_result</name>
    <message>
        <source>No result yet: register, or load an earlier result.</source>
        <translation>Noch kein Ergebnis: Registrieren Sie, oder laden Sie ein früheres Ergebnis.</translation>
    </message>
    <message>
        <source>The result has lost its table of motions: register again, or load the result again.</source>
        <translation>Dem Ergebnis fehlt die Tabelle der Bewegungen: Registrieren Sie neu, oder laden Sie das Ergebnis neu.</translation>
    </message>
    <message>
        <source>Choose the CT of the result.</source>
        <translation>Wählen Sie das CT des Ergebnisses.</translation>
    </message>
    <message>
        <source>Choose the segmentation of the result&apos;s bones: it says where they are.</source>
        <translation>Wählen Sie die Segmentierung der Knochen des Ergebnisses: Sie sagt, wo diese sind.</translation>
    </message>
    <message>
        <source>The result has lost its warped CT or segmentation: register again, or load the result again.</source>
        <translation>Dem Ergebnis fehlt das verformte CT oder die Segmentierung: Registrieren Sie neu, oder laden Sie das Ergebnis neu.</translation>
    </message>
    <message>
        <source>The result&apos;s structure &apos;{name}&apos; has no segment: assign it in the first section.</source>
        <translation>Die Struktur „{name}“ des Ergebnisses hat kein Segment: Ordnen Sie es im ersten Abschnitt zu.</translation>
    </message>
</context>
<context>
    <name>study.track_images</name>
    <message>
        <source>{camera} frames</source>
        <translation>{camera}: Bilder</translation>
    </message>
    <message>
        <source>{camera} X-ray</source>
        <translation>{camera}: Röntgenbild</translation>
    </message>
</context>
<context>
    <name>study.track_plan</name>
    <message>
        <source>The camera of &apos;{name}&apos; is not known: register one frame of all sequences first, whose cameras are then kept, or state that the camera is known exactly.</source>
        <translation>Die Kamera von &apos;{name}&apos; ist nicht bekannt: zuerst einen Zeitpunkt aller Sequenzen registrieren, dessen Kameras dann übernommen werden, oder angeben, dass die Kamera genau bekannt ist.</translation>
    </message>
    <message>
        <source>The images do not state how many frames there are in a second: enter it.</source>
        <translation>Die Bilder geben nicht an, wie viele auf eine Sekunde kommen: die Zahl eingeben.</translation>
    </message>
    <message>
        <source>No frame is left: there are {count}, counted from 0. Check the first and the last frame.</source>
        <translation>Kein Zeitpunkt ist übrig: es gibt {count}, von 0 an gezählt. Den ersten und den letzten prüfen.</translation>
    </message>
    <message>
        <source>Choose the bones first</source>
        <translation>Erst die Knochen wählen</translation>
    </message>
    <message>
        <source>Two X-rays have the name &quot;{name}&quot;: give each camera its own.</source>
        <translation>Zwei Röntgenbilder heißen &quot;{name}&quot;: jeder Kamera einen eigenen Namen geben.</translation>
    </message>
    <message>
        <source>Find the cameras first</source>
        <translation>Erst die Kameras finden</translation>
    </message>
    <message>
        <source>Enter the frame rate</source>
        <translation>Die Bildrate eingeben</translation>
    </message>
    <message>
        <source>No frame is left that every camera has: check which image each X-ray shows (Frame).</source>
        <translation>Kein Zeitpunkt ist übrig, den jede Kamera hat: prüfen, welches Bild jedes Röntgenbild zeigt (Bild).</translation>
    </message>
    <message>
        <source>Check the frames</source>
        <translation>Die Zeitpunkte prüfen</translation>
    </message>
    <message>
        <source>Register one frame first</source>
        <translation>Erst einen Zeitpunkt registrieren</translation>
    </message>
    <message>
        <source>There is no result to start from: register one frame, or choose another start.</source>
        <translation>Es gibt kein Ergebnis für den Beginn: einen Zeitpunkt registrieren oder einen anderen Beginn wählen.</translation>
    </message>
    <message>
        <source>Choose the CT.</source>
        <translation>Wählen Sie das CT.</translation>
    </message>
    <message>
        <source>Choose the segmentation of the CT&apos;s bones.</source>
        <translation>Wählen Sie die Segmentierung der Knochen des CT.</translation>
    </message>
    <message>
        <source>Assign at least one segment to a structure, or have the structures proposed.</source>
        <translation>Ordnen Sie mindestens ein Segment einer Struktur zu, oder lassen Sie die Strukturen vorschlagen.</translation>
    </message>
    <message>
        <source>Choose the reference: the structure relative to which motions are reported.</source>
        <translation>Den Bezug wählen: die Struktur, relativ zu der Bewegungen angegeben werden.</translation>
    </message>
    <message>
        <source>Let a bone move</source>
        <translation>Einen Knochen bewegen lassen</translation>
    </message>
    <message>
        <source>Every structure stands still: uncheck those that move in the sequence.</source>
        <translation>Alle Strukturen stehen still: die abwählen, die sich in der Sequenz bewegen.</translation>
    </message>
    <message>
        <source>Add an X-ray sequence first</source>
        <translation>Erst eine Sequenz hinzufügen</translation>
    </message>
    <message>
        <source>None of the X-rays is a sequence: add one for each camera in the section X-rays.</source>
        <translation>Keines der Röntgenbilder ist eine Sequenz: im Abschnitt Röntgenbilder für jede Kamera eine hinzufügen.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is not ready: complete its geometry, or remove it.</source>
        <translation>Das Röntgenbild „{name}“ ist nicht bereit: Vervollständigen Sie seine Geometrie, oder entfernen Sie es.</translation>
    </message>
    <message>
        <source>Name the X-rays first</source>
        <translation>Erst die Röntgenbilder benennen</translation>
    </message>
    <message>
        <source>One camera shows next to nothing of motion along its rays: two are better.</source>
        <translation>Eine Kamera zeigt so gut wie nichts von einer Bewegung längs ihrer Strahlen: zwei sind besser.</translation>
    </message>
    <message>
        <source>Complete the X-rays first</source>
        <translation>Erst die Röntgenbilder ergänzen</translation>
    </message>
    <message>
        <source>The sequences state different numbers of frames per second ({rates}): enter the true one.</source>
        <translation>Die Sequenzen geben verschiedene Zahlen von Bildern pro Sekunde an ({rates}): die richtige eingeben.</translation>
    </message>
    <message>
        <source>The result&apos;s poses of structures that stand still are flagged as uncertain ({names}), but the track takes them as exact and flags nothing: let them move, or correct them and register again.</source>
        <translation>Posen stillstehender Strukturen im Ergebnis sind als unsicher markiert ({names}), die Verfolgung nimmt sie aber als genau und markiert nichts: Lassen Sie sie sich bewegen, oder korrigieren Sie sie und registrieren Sie erneut.</translation>
    </message>
    <message>
        <source>{count} X-rays are single images and are not tracked.</source>
        <translation>{count} Röntgenbilder sind einzelne Bilder und werden nicht verfolgt.</translation>
    </message>
    <message>
        <source>The sequences have different numbers of images from frame 0 on ({each}): what one of them lacks is not tracked.</source>
        <translation>Die Sequenzen haben ab Zeitpunkt 0 verschieden viele Bilder ({each}): was einer fehlt, wird nicht verfolgt.</translation>
    </message>
    <message>
        <source>The images state {rate:.4g} frames per second, another number than was entered.</source>
        <translation>Die Bilder geben {rate:.4g} pro Sekunde an, eine andere Zahl als eingegeben wurde.</translation>
    </message>
    <message>
        <source>{name}: by their times, images are missing after image {number}; frames are taken as evenly spaced.</source>
        <translation>{name}: Den Zeiten nach fehlen Bilder nach Bild {number}; die Zeitpunkte gelten als gleichmäßig verteilt.</translation>
    </message>
    <message>
        <source>The result&apos;s poses belong to another frame than {frame}, which starts from them nevertheless.</source>
        <translation>Die Lagen des Ergebnisses sind nicht die von Zeitpunkt {frame}, der trotzdem dort beginnt.</translation>
    </message>
</context>
<context>
    <name>study.track_request</name>
    <message>
        <source>where the CT has the bones</source>
        <translation>wo das CT die Knochen hat</translation>
    </message>
    <message>
        <source>registration of the first frame</source>
        <translation>Registrierung des ersten Zeitpunkts</translation>
    </message>
    <message>
        <source>poses of the present result</source>
        <translation>Lagen des jetzigen Ergebnisses</translation>
    </message>
</context>
<context>
    <name>study.track_scene</name>
    <message>
        <source>Track</source>
        <translation>Verfolgung</translation>
    </message>
    <message>
        <source>Track, all numbers</source>
        <translation>Verfolgung, alle Zahlen</translation>
    </message>
    <message>
        <source>{bone} poses</source>
        <translation>{bone}: Lagen</translation>
    </message>
    <message>
        <source>The X-rays &apos;{image}&apos; have {columns} x {rows} pixels, but the track&apos;s camera &apos;{camera}&apos; has {width} x {height}: choose those that were tracked.</source>
        <translation>Die Röntgenbilder „{image}“ haben {columns} x {rows} Pixel, die Kamera „{camera}“ der Verfolgung aber {width} x {height}: Wählen Sie die verfolgten.</translation>
    </message>
    <message>
        <source>{bone} pose</source>
        <translation>{bone}: Lage</translation>
    </message>
    <message>
        <source>{bone} in motion</source>
        <translation>{bone} in Bewegung</translation>
    </message>
    <message>
        <source>The track&apos;s structure &apos;{name}&apos; has no segment: assign it in the first section.</source>
        <translation>Die Struktur „{name}“ der Verfolgung hat kein Segment: Ordnen Sie es im ersten Abschnitt zu.</translation>
    </message>
    <message>
        <source>The segments of &apos;{name}&apos; hold no voxel: draw them.</source>
        <translation>Die Segmente von „{name}“ enthalten kein Voxel: Zeichnen Sie sie.</translation>
    </message>
    <message>
        <source>The segments of &apos;{name}&apos; are not where they were when the track was made: choose its CT and segmentation, and put them where they were.</source>
        <translation>Die Segmente von &apos;{name}&apos; liegen nicht dort, wo sie bei der Verfolgung lagen: Wählen Sie deren CT und Segmentierung, und bringen Sie beide wieder dorthin.</translation>
    </message>
</context>
<context>
    <name>study.track_settings</name>
    <message>
        <source>The track &apos;{name}&apos; of the scene is damaged: delete it, and track again.</source>
        <translation>Die Verfolgung &apos;{name}&apos; der Szene ist beschädigt: Löschen Sie sie, und verfolgen Sie neu.</translation>
    </message>
</context>
<context>
    <name>study.track_writer</name>
    <message>
        <source>The tracking was cancelled.</source>
        <translation>Die Verfolgung wurde abgebrochen.</translation>
    </message>
</context>
<context>
    <name>study.writer</name>
    <message>
        <source>The segmentation &apos;{segmentation}&apos; has {count} segments named &apos;{name}&apos;: give the ID of one.</source>
        <translation>Die Segmentierung „{segmentation}“ hat {count} Segmente namens „{name}“: Geben Sie die ID von einem an.</translation>
    </message>
    <message>
        <source>No CT is chosen: choose a volume.</source>
        <translation>Kein CT ist gewählt: Wählen Sie ein Volumen.</translation>
    </message>
    <message>
        <source>No segmentation is chosen: choose that of the CT&apos;s bones.</source>
        <translation>Keine Segmentierung ist gewählt: Wählen Sie die der Knochen des CT.</translation>
    </message>
    <message>
        <source>No structure is chosen: include at least the anchor and one other bone.</source>
        <translation>Keine Struktur ist gewählt: Beziehen Sie mindestens den Anker und einen weiteren Knochen ein.</translation>
    </message>
    <message>
        <source>There is no X-ray: add at least one; two from different directions are better.</source>
        <translation>Es gibt kein Röntgenbild: Fügen Sie mindestens eines hinzu; zwei aus verschiedenen Richtungen sind besser.</translation>
    </message>
    <message>
        <source>The segmentation &apos;{segmentation}&apos; has no segment named &apos;{name}&apos;.</source>
        <translation>Die Segmentierung „{segmentation}“ hat kein Segment namens „{name}“.</translation>
    </message>
    <message>
        <source>The anchor &apos;{anchor}&apos; is not one of the structures: choose one of them.</source>
        <translation>Der Anker „{anchor}“ ist keine der Strukturen: Wählen Sie eine von ihnen.</translation>
    </message>
    <message>
        <source>PolyPose needs about {needed:.1f} GB in {folder}, where {free:.1f} GB are free: free some space, or set another temporary folder in Slicer&apos;s settings.</source>
        <translation>PolyPose braucht etwa {needed:.1f} GB in {folder}, wo {free:.1f} GB frei sind: Platz schaffen oder in den Einstellungen von Slicer einen anderen temporären Ordner wählen.</translation>
    </message>
    <message>
        <source>The structure &apos;{structure}&apos; has no voxels of its own inside the CT: leave it out, or correct its segments.</source>
        <translation>Die Struktur „{structure}“ hat innerhalb des CT keine eigenen Voxel: Lassen Sie sie weg, oder berichtigen Sie ihre Segmente.</translation>
    </message>
    <message>
        <source>{file} could not be written completely into {folder}: free some space there, or set another temporary folder in Slicer&apos;s settings.</source>
        <translation>{file} konnte nicht vollständig in {folder} geschrieben werden: Schaffen Sie dort Platz, oder wählen Sie in den Einstellungen von Slicer einen anderen temporären Ordner.</translation>
    </message>
    <message>
        <source>Segment &apos;{segment}&apos; shares {percent:.0f} % of its voxels with other structures, which keep them: correct the segmentation where they overlap.</source>
        <translation>Das Segment „{segment}“ teilt {percent:.0f} % seiner Voxel mit anderen Strukturen, die sie behalten: Berichtigen Sie die Segmentierung, wo sie sich überlappen.</translation>
    </message>
</context>
<context>
    <name>study.xray_reading</name>
    <message>
        <source>the table of X-rays</source>
        <translation>die Tabelle der Röntgenbilder</translation>
    </message>
    <message>
        <source>initial</source>
        <translation>Startkamera</translation>
    </message>
    <message>
        <source>ready</source>
        <translation>bereit</translation>
    </message>
    <message>
        <source>known exactly</source>
        <translation>genau bekannt</translation>
    </message>
    <message>
        <source>none yet: it will be searched for, unless you place the C-arm</source>
        <translation>noch keine: Sie wird gesucht, außer Sie stellen den C-Bogen</translation>
    </message>
    <message>
        <source>unknown</source>
        <translation>unbekannt</translation>
    </message>
    <message>
        <source>not ready</source>
        <translation>nicht bereit</translation>
    </message>
    <message>
        <source>none yet: an uncertain one was found, review it</source>
        <translation>noch keine: Eine unsichere wurde gefunden, prüfen Sie sie</translation>
    </message>
    <message>
        <source>uncertain, accepted by you</source>
        <translation>unsicher, von Ihnen übernommen</translation>
    </message>
    <message>
        <source>initial, from landmarks</source>
        <translation>Startkamera aus Landmarken</translation>
    </message>
    <message>
        <source>none yet: pick landmarks</source>
        <translation>noch keine: Setzen Sie Landmarken</translation>
    </message>
    <message>
        <source>DICOM</source>
        <translation>DICOM</translation>
    </message>
    <message>
        <source>ready; {count} warnings</source>
        <translation>bereit; {count} Warnungen</translation>
    </message>
    <message>
        <source>found, within {degrees:.0f} deg and {mm:.0f} mm</source>
        <translation>gefunden, auf {degrees:.0f}° und {mm:.0f} mm genau</translation>
    </message>
    <message>
        <source>initial, within {degrees:.0f} deg and {mm:.0f} mm</source>
        <translation>Startkamera, auf {degrees:.0f}° und {mm:.0f} mm genau</translation>
    </message>
    <message>
        <source>transform</source>
        <translation>Transformation</translation>
    </message>
    <message>
        <source>image only</source>
        <translation>nur das Bild</translation>
    </message>
    <message>
        <source>{file} does not describe the geometry of &apos;{xray}&apos;: choose a study file with an entry for it.</source>
        <translation>{file} beschreibt nicht die Geometrie von „{xray}“: Wählen Sie eine Studiendatei mit einem Eintrag dafür.</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>Warnung: {text}</translation>
    </message>
    <message>
        <source>known, from a file</source>
        <translation>bekannt, aus einer Datei</translation>
    </message>
    <message>
        <source>geometry file</source>
        <translation>Geometriedatei</translation>
    </message>
    <message>
        <source>entered</source>
        <translation>eingegeben</translation>
    </message>
    <message>
        <source>{file} cannot be read as JSON ({reason}): choose a study file.</source>
        <translation>{file} kann nicht als JSON gelesen werden ({reason}): Wählen Sie eine Studiendatei.</translation>
    </message>
    <message>
        <source>It cannot be read: {reason}.</source>
        <translation>Es kann nicht gelesen werden: {reason}.</translation>
    </message>
</context>
<context>
    <name>study.xray_series</name>
    <message>
        <source>The sequence &apos;{name}&apos; has {count} images, but its file has {in_file}: load it again from its file.</source>
        <translation>Die Sequenz &apos;{name}&apos; hat {count} Bilder, ihre Datei aber {in_file}: sie aus ihrer Datei neu laden.</translation>
    </message>
    <message>
        <source>Image {number} of the sequence &apos;{name}&apos; has another size, type or spacing than the first: choose a sequence of one camera.</source>
        <translation>Bild {number} der Sequenz &apos;{name}&apos; hat eine andere Größe, einen anderen Typ oder Abstand als das erste: eine Sequenz einer einzigen Kamera wählen.</translation>
    </message>
</context>
<context>
    <name>study.xray_source</name>
    <message>
        <source>The stored fields of an X-ray are damaged: remove the X-ray and add it again.</source>
        <translation>Die gespeicherten Felder eines Röntgenbilds sind beschädigt: Entfernen Sie das Röntgenbild, und fügen Sie es wieder hinzu.</translation>
    </message>
    <message>
        <source>An X-ray needs an image of the scene or a file: choose one.</source>
        <translation>Ein Röntgenbild braucht ein Bild der Szene oder eine Datei: Wählen Sie eines davon.</translation>
    </message>
    <message>
        <source>The sequence &apos;{name}&apos; has {count} images: choose one of them as the frame.</source>
        <translation>Die Sequenz „{name}“ hat {count} Bilder: Wählen Sie eines davon als Einzelbild.</translation>
    </message>
    <message>
        <source>The sequence &apos;{name}&apos; does not hold images: choose another.</source>
        <translation>Die Sequenz „{name}“ enthält keine Bilder: Wählen Sie eine andere.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is not an image: choose a volume or a sequence of volumes.</source>
        <translation>„{name}“ ist kein Bild: Wählen Sie ein Volumen oder eine Sequenz von Volumen.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; has no pixels: load it again.</source>
        <translation>Das Röntgenbild „{name}“ hat keine Pixel: Laden Sie es erneut.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is a volume of {count} images: choose one of them as its frame.</source>
        <translation>Das Röntgenbild „{name}“ ist ein Volumen aus {count} Bildern: Wählen Sie eines davon als Einzelbild.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; has {count} images: choose one of them as its frame.</source>
        <translation>Das Röntgenbild „{name}“ hat {count} Bilder: Wählen Sie eines davon als Einzelbild.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is a file and not an image of the scene: load it.</source>
        <translation>Das Röntgenbild „{name}“ ist eine Datei und kein Bild der Szene: Laden Sie es.</translation>
    </message>
</context>
</TS>
