<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="fr" sourcelanguage="en">
<context>
    <name>PolyPose</name>
    <message>
        <source>Aligns one CT to two or more X-rays of the same patient in another posture: every bone keeps its shape and gets its own rigid motion, soft tissue follows smoothly. Research software, not for clinical decisions.</source>
        <translation>Aligne un scanner sur deux radiographies ou plus du même patient dans une autre posture&#xa0;: chaque os garde sa forme et reçoit son propre mouvement rigide, les tissus mous suivent régulièrement. Logiciel de recherche, non destiné aux décisions cliniques.</translation>
    </message>
    <message>
        <source>The method is the polyrigid 2D/3D registration of Gopalakrishnan et al. (PolyPose, 2025).</source>
        <translation>La méthode est le recalage polyrigide 2D/3D de Gopalakrishnan et al. (PolyPose, 2025).</translation>
    </message>
    <message>
        <source>Research software, not for clinical decisions.</source>
        <translation>Logiciel de recherche, non destiné aux décisions cliniques.</translation>
    </message>
    <message>
        <source>1. CT and bones</source>
        <translation>1. Scanner et os</translation>
    </message>
    <message>
        <source>CT:</source>
        <translation>Scanner&#xa0;:</translation>
    </message>
    <message>
        <source>The preoperative CT, in Hounsfield units.</source>
        <translation>Le scanner préopératoire, en unités Hounsfield.</translation>
    </message>
    <message>
        <source>Choose the CT</source>
        <translation>Choisir le scanner</translation>
    </message>
    <message>
        <source>Segmentation:</source>
        <translation>Segmentation&#xa0;:</translation>
    </message>
    <message>
        <source>Segmentation of the CT with one segment per bone.</source>
        <translation>Segmentation du scanner avec un segment par os.</translation>
    </message>
    <message>
        <source>Choose the segmentation</source>
        <translation>Choisir la segmentation</translation>
    </message>
    <message>
        <source>Segment bones</source>
        <translation>Segmenter</translation>
    </message>
    <message>
        <source>Segment the CT with the extension TotalSegmentator or MONAIAuto3DSeg, and propose the structures.</source>
        <translation>Segmenter le scanner avec l&apos;extension TotalSegmentator ou MONAIAuto3DSeg et proposer les structures.</translation>
    </message>
    <message>
        <source>Propose structures</source>
        <translation>Proposer les structures</translation>
    </message>
    <message>
        <source>Give every segment whose name is that of a bone, as TotalSegmentator names them, its usual structure, and choose an anchor.</source>
        <translation>Donner à chaque segment qui porte le nom d&apos;un os, selon les noms de TotalSegmentator, sa structure habituelle, et choisir une ancre.</translation>
    </message>
    <message>
        <source>How finely the spine and the ribs are divided.</source>
        <translation>Avec quelle finesse le rachis et les côtes sont divisés.</translation>
    </message>
    <message>
        <source>Spine and ribs by region</source>
        <translation>Rachis et côtes par région</translation>
    </message>
    <message>
        <source>Every vertebra and rib</source>
        <translation>Chaque vertèbre et côte</translation>
    </message>
    <message>
        <source>Show only the segments whose name or structure contains this text.</source>
        <translation>N&apos;afficher que les segments dont le nom ou la structure contient ce texte.</translation>
    </message>
    <message>
        <source>Search segments</source>
        <translation>Chercher des segments</translation>
    </message>
    <message>
        <source>Included only</source>
        <translation>Inclus seulement</translation>
    </message>
    <message>
        <source>Hide the segments that do not move as a bone.</source>
        <translation>Masquer les segments qui ne se déplacent pas comme un os.</translation>
    </message>
    <message>
        <source>A structure is what moves as one rigid body: segments with the same structure move together. The anchor stays where it is and defines the cameras.</source>
        <translation>Une structure est ce qui se déplace comme un seul corps rigide&#xa0;: les segments de même structure bougent ensemble. L&apos;ancre reste en place et définit les caméras.</translation>
    </message>
    <message>
        <source>2. X-rays</source>
        <translation>2. Radiographies</translation>
    </message>
    <message>
        <source>A loaded X-ray: a volume of one image, or a sequence of them.</source>
        <translation>Une radiographie chargée&#xa0;: un volume d&apos;une image, ou une séquence de tels volumes.</translation>
    </message>
    <message>
        <source>Loaded X-ray</source>
        <translation>Image chargée</translation>
    </message>
    <message>
        <source>Add</source>
        <translation>Ajouter</translation>
    </message>
    <message>
        <source>Add the chosen X-ray to the table.</source>
        <translation>Ajouter au tableau la radiographie choisie.</translation>
    </message>
    <message>
        <source>Add X-rays from files.</source>
        <translation>Ajouter des radiographies depuis des fichiers.</translation>
    </message>
    <message>
        <source>Files...</source>
        <translation>Fichiers...</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>Retirer</translation>
    </message>
    <message>
        <source>Take the selected X-ray out of the table; the image itself stays.</source>
        <translation>Retirer du tableau la radiographie sélectionnée&#xa0;; l&apos;image elle-même reste.</translation>
    </message>
    <message>
        <source>Geometry of the selected X-ray</source>
        <translation>Géométrie de la radiographie sélectionnée</translation>
    </message>
    <message>
        <source>Name:</source>
        <translation>Nom&#xa0;:</translation>
    </message>
    <message>
        <source>What this X-ray is called in tables and views.</source>
        <translation>Le nom de cette radiographie dans les tableaux et les vues.</translation>
    </message>
    <message>
        <source>Frame:</source>
        <translation>Image n°&#xa0;:</translation>
    </message>
    <message>
        <source>Which image of the sequence or of the file, counted from 1.</source>
        <translation>Quelle image de la séquence ou du fichier, comptée à partir de 1.</translation>
    </message>
    <message>
        <source>Camera is:</source>
        <translation>La caméra est&#xa0;:</translation>
    </message>
    <message>
        <source>How the registration treats the camera: as an initial camera to refine, as exactly known, or as unknown.</source>
        <translation>Comment le recalage traite la caméra&#xa0;: comme une caméra initiale à affiner, comme connue exactement, ou comme inconnue.</translation>
    </message>
    <message>
        <source>an initial camera</source>
        <translation>une caméra initiale</translation>
    </message>
    <message>
        <source>known exactly</source>
        <translation>connue exactement</translation>
    </message>
    <message>
        <source>to be found</source>
        <translation>à trouver</translation>
    </message>
    <message>
        <source>Source to detector [mm]:</source>
        <translation>Source-détecteur [mm]&#xa0;:</translation>
    </message>
    <message>
        <source>Distance from the X-ray source to the detector. Leave it empty to use the value in the file.</source>
        <translation>Distance de la source de rayons X au détecteur. Laissez vide pour utiliser la valeur du fichier.</translation>
    </message>
    <message>
        <source>Source to isocentre [mm]:</source>
        <translation>Source-isocentre [mm]&#xa0;:</translation>
    </message>
    <message>
        <source>Distance from the X-ray source to the C-arm&apos;s isocentre. Leave it empty to use the value in the file.</source>
        <translation>Distance de la source de rayons X à l&apos;isocentre de l&apos;arceau. Laissez vide pour utiliser la valeur du fichier.</translation>
    </message>
    <message>
        <source>Distance of pixel centres, between rows and between columns.</source>
        <translation>Distance entre les centres des pixels, entre les lignes et entre les colonnes.</translation>
    </message>
    <message>
        <source>Pixel spacing [mm]:</source>
        <translation>Taille des pixels [mm]&#xa0;:</translation>
    </message>
    <message>
        <source>Distance between rows on the detector, not at the patient. Leave it empty to use the value in the file.</source>
        <translation>Distance entre les lignes sur le détecteur, et non au niveau du patient. Laissez vide pour utiliser la valeur du fichier.</translation>
    </message>
    <message>
        <source>Distance between columns on the detector, not at the patient. Leave it empty to use the value in the file.</source>
        <translation>Distance entre les colonnes sur le détecteur, et non au niveau du patient. Laissez vide pour utiliser la valeur du fichier.</translation>
    </message>
    <message>
        <source>Column and row of the pixel on which the beam is perpendicular, counted from 0.</source>
        <translation>Colonne et ligne du pixel auquel le faisceau est perpendiculaire, comptées à partir de 0.</translation>
    </message>
    <message>
        <source>Principal point [px]:</source>
        <translation>Point principal [px]&#xa0;:</translation>
    </message>
    <message>
        <source>Where the perpendicular from the source meets the detector, in the file&apos;s own pixels; the first pixel&apos;s centre is 0. Leave it empty for the centre of the image, or the value in the file.</source>
        <translation>Où la perpendiculaire issue de la source rencontre le détecteur, en pixels du fichier&#xa0;; le centre du premier pixel est 0. Laissez vide pour le centre de l&apos;image, ou la valeur du fichier.</translation>
    </message>
    <message>
        <source>The row of the same point.</source>
        <translation>La ligne du même point.</translation>
    </message>
    <message>
        <source>LAO + / RAO - [deg]:</source>
        <translation>LAO + / RAO - [deg]&#xa0;:</translation>
    </message>
    <message>
        <source>Primary angle of the C-arm; positive with the detector toward the patient&apos;s left (LAO). Leave it empty to use the value in the file.</source>
        <translation>Angle primaire de l&apos;arceau&#xa0;; positif quand le détecteur est vers la gauche du patient (LAO). Laissez vide pour utiliser la valeur du fichier.</translation>
    </message>
    <message>
        <source>CRA + / CAU - [deg]:</source>
        <translation>CRA + / CAU - [deg]&#xa0;:</translation>
    </message>
    <message>
        <source>Secondary angle of the C-arm; positive with the detector toward the head (CRA). Leave it empty to use the value in the file.</source>
        <translation>Angle secondaire de l&apos;arceau&#xa0;; positif quand le détecteur est vers la tête (CRA). Laissez vide pour utiliser la valeur du fichier.</translation>
    </message>
    <message>
        <source>Patient position:</source>
        <translation>Position du patient&#xa0;:</translation>
    </message>
    <message>
        <source>Head or feet first; supine, prone or on one side. Used with angles that are entered here.</source>
        <translation>Tête ou pieds en premier&#xa0;; décubitus dorsal, ventral ou latéral. Sert avec les angles saisis ici.</translation>
    </message>
    <message>
        <source>Image seen from:</source>
        <translation>Image vue depuis&#xa0;:</translation>
    </message>
    <message>
        <source>C-arms display the image as seen from the detector; a film on a view box may be the other way round.</source>
        <translation>Les arceaux affichent l&apos;image vue depuis le détecteur&#xa0;; un film sur un négatoscope peut être dans l&apos;autre sens.</translation>
    </message>
    <message>
        <source>as in the file</source>
        <translation>comme dans le fichier</translation>
    </message>
    <message>
        <source>the detector (mirrored)</source>
        <translation>le détecteur (en miroir)</translation>
    </message>
    <message>
        <source>the source</source>
        <translation>la source</translation>
    </message>
    <message>
        <source>Distortion:</source>
        <translation>Distorsion&#xa0;:</translation>
    </message>
    <message>
        <source>Image intensifiers bend straight lines. An image with a round field counts as distorted, and its uncertainties are wider, unless it was corrected.</source>
        <translation>Les amplificateurs de brillance courbent les lignes droites. Une image à champ rond est tenue pour distordue, et ses incertitudes sont plus larges, sauf si elle a été corrigée.</translation>
    </message>
    <message>
        <source>by the field&apos;s shape</source>
        <translation>selon la forme du champ</translation>
    </message>
    <message>
        <source>corrected</source>
        <translation>corrigée</translation>
    </message>
    <message>
        <source>not corrected</source>
        <translation>non corrigée</translation>
    </message>
    <message>
        <source>Camera&apos;s transform:</source>
        <translation>Transformation&#xa0;:</translation>
    </message>
    <message>
        <source>A transform from the camera&apos;s axes (x along the columns, y down the rows, z toward the detector) to the patient; it is made by &apos;Use as initial camera&apos;.</source>
        <translation>Une transformation des axes de la caméra (x le long des colonnes, y vers le bas des lignes, z vers le détecteur) vers le patient&#xa0;; elle est créée par «&#xa0;Utiliser comme caméra initiale&#xa0;».</translation>
    </message>
    <message>
        <source>None</source>
        <translation>Aucune</translation>
    </message>
    <message>
        <source>Read geometry from a file...</source>
        <translation>Géométrie d&apos;un fichier...</translation>
    </message>
    <message>
        <source>Take distances, angles and the camera from a study file (JSON), for the X-ray of the same name or place in it.</source>
        <translation>Prendre les distances, les angles et la caméra d&apos;un fichier d&apos;étude (JSON), pour la radiographie de même nom ou de même rang.</translation>
    </message>
    <message>
        <source>Clear entered geometry</source>
        <translation>Effacer la saisie</translation>
    </message>
    <message>
        <source>Use the values in the image&apos;s own file again.</source>
        <translation>Utiliser de nouveau les valeurs du fichier de l&apos;image.</translation>
    </message>
    <message>
        <source>3. Initial cameras (optional)</source>
        <translation>3. Caméras initiales (facultatif)</translation>
    </message>
    <message>
        <source>Where the registration of the selected X-ray starts; it refines every camera that is not known exactly.</source>
        <translation>D&apos;où part le recalage de la radiographie sélectionnée&#xa0;; il affine chaque caméra qui n&apos;est pas connue exactement.</translation>
    </message>
    <message>
        <source>Camera source:</source>
        <translation>Source de la caméra&#xa0;:</translation>
    </message>
    <message>
        <source>Where the initial camera of the selected X-ray comes from.</source>
        <translation>D&apos;où vient la caméra initiale de la radiographie sélectionnée.</translation>
    </message>
    <message>
        <source>Search near:</source>
        <translation>Chercher près de&#xa0;:</translation>
    </message>
    <message>
        <source>The view as it was ordered; the search stays within 45 degrees of it. Position of the detector: AP behind the patient, PA in front, LL at the left side, RL at the right side.</source>
        <translation>L&apos;incidence telle qu&apos;elle a été prescrite&#xa0;; la recherche reste à moins de 45 degrés d&apos;elle. Position du détecteur&#xa0;: AP derrière le patient, PA devant, LL du côté gauche, RL du côté droit.</translation>
    </message>
    <message>
        <source>Calibration:</source>
        <translation>Étalonnage&#xa0;:</translation>
    </message>
    <message>
        <source>A calibrated camera: a 3x4 projection matrix (CSV or JSON), a MayaCam 2.0 text, or intrinsics with distortion (JSON). Its pose is used only when the calibration is the camera source; it must then be given in the CT&apos;s coordinates (LPS, mm).</source>
        <translation>Une caméra étalonnée&#xa0;: une matrice de projection 3x4 (CSV ou JSON), un texte MayaCam 2.0, ou des paramètres intrinsèques avec distorsion (JSON). Sa pose n&apos;est utilisée que si l&apos;étalonnage est la source de la caméra&#xa0;; elle doit alors être donnée dans les coordonnées du scanner (LPS, mm).</translation>
    </message>
    <message>
        <source>Camera model:</source>
        <translation>Modèle de caméra&#xa0;:</translation>
    </message>
    <message>
        <source>A model trained by python -m PolyPoseLib train on this CT and this anchor; models of other CTs are refused.</source>
        <translation>Un modèle entraîné par python -m PolyPoseLib train sur ce scanner et cette ancre&#xa0;; les modèles d&apos;autres scanners sont refusés.</translation>
    </message>
    <message>
        <source>Rig:</source>
        <translation>Montage&#xa0;:</translation>
    </message>
    <message>
        <source>none: this camera is independent</source>
        <translation>aucun&#xa0;: cette caméra est indépendante</translation>
    </message>
    <message>
        <source>Name of the calibrated rig, such as a biplane stand, that took this X-ray. Give the same name to the other X-rays of the rig: their cameras keep the relative pose of their calibrations, and what is found for one places the others.</source>
        <translation>Nom du montage étalonné, tel qu&apos;un statif biplan, qui a pris cette radiographie. Donnez le même nom aux autres radiographies du montage&#xa0;: leurs caméras gardent la pose relative de leurs étalonnages, et ce qui est trouvé pour l&apos;une place les autres.</translation>
    </message>
    <message>
        <source>Landmarks</source>
        <translation>Repères</translation>
    </message>
    <message>
        <source>Pick four or more points on the anchor, far apart and not in one line, in the CT and in the X-ray. Points with the same name form a pair.</source>
        <translation>Placez quatre points ou plus sur l&apos;ancre, éloignés les uns des autres et non alignés, dans le scanner et dans la radiographie. Les points de même nom forment une paire.</translation>
    </message>
    <message>
        <source>In the CT:</source>
        <translation>Dans le scanner&#xa0;:</translation>
    </message>
    <message>
        <source>Points in the CT; X-rays may share a list.</source>
        <translation>Points dans le scanner&#xa0;; des radiographies peuvent partager une liste.</translation>
    </message>
    <message>
        <source>None yet</source>
        <translation>Aucune encore</translation>
    </message>
    <message>
        <source>Pick</source>
        <translation>Placer</translation>
    </message>
    <message>
        <source>Pick points in the slices or on the bones in 3D; press again, or click the right mouse button, to end.</source>
        <translation>Placer des points dans les coupes ou sur les os en 3D&#xa0;; appuyez de nouveau, ou cliquez avec le bouton droit de la souris, pour terminer.</translation>
    </message>
    <message>
        <source>In the X-ray:</source>
        <translation>Dans la radiographie&#xa0;:</translation>
    </message>
    <message>
        <source>Points in this X-ray; each X-ray has its own list.</source>
        <translation>Points dans cette radiographie&#xa0;; chaque radiographie a sa propre liste.</translation>
    </message>
    <message>
        <source>Show the X-ray in its own view, and pick points there; press again, or click the right mouse button, to end.</source>
        <translation>Afficher la radiographie dans sa propre vue et y placer des points&#xa0;; appuyez de nouveau, ou cliquez avec le bouton droit de la souris, pour terminer.</translation>
    </message>
    <message>
        <source>How far each landmark of the CT projects from its counterpart in the X-ray: in mm at its depth, and in pixels.</source>
        <translation>À quelle distance de son homologue dans la radiographie se projette chaque repère du scanner&#xa0;: en mm à sa profondeur, et en pixels.</translation>
    </message>
    <message>
        <source>Remove pair</source>
        <translation>Supprimer la paire</translation>
    </message>
    <message>
        <source>Delete the selected landmark from both lists.</source>
        <translation>Supprimer des deux listes le repère sélectionné.</translation>
    </message>
    <message>
        <source>Find camera</source>
        <translation>Trouver la caméra</translation>
    </message>
    <message>
        <source>Find the camera of the selected X-ray; without it, the registration searches when it starts.</source>
        <translation>Trouver la caméra de la radiographie sélectionnée&#xa0;; sinon, le recalage la cherche au démarrage.</translation>
    </message>
    <message>
        <source>Find all</source>
        <translation>Trouver toutes</translation>
    </message>
    <message>
        <source>Find the camera of every X-ray that has none.</source>
        <translation>Trouver la caméra de chaque radiographie qui n&apos;en a pas.</translation>
    </message>
    <message>
        <source>Show</source>
        <translation>Afficher</translation>
    </message>
    <message>
        <source>Show the CT rendered by this camera over the X-ray, and the C-arm in 3D.</source>
        <translation>Afficher le rendu du scanner par cette caméra sur la radiographie, et l&apos;arceau en 3D.</translation>
    </message>
    <message>
        <source>Accept</source>
        <translation>Accepter</translation>
    </message>
    <message>
        <source>Start the registration from this uncertain camera.</source>
        <translation>Faire partir le recalage de cette caméra incertaine.</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>Rejeter</translation>
    </message>
    <message>
        <source>Discard the camera that was found.</source>
        <translation>Rejeter la caméra trouvée.</translation>
    </message>
    <message>
        <source>4. Place the C-arm (optional)</source>
        <translation>4. Placer l&apos;arceau (facultatif)</translation>
    </message>
    <message>
        <source>Move the sliders until the rendering of the CT lies on the X-ray. It need not be exact: the registration refines it.</source>
        <translation>Déplacez les curseurs jusqu&apos;à ce que le rendu du scanner se superpose à la radiographie. Il n&apos;a pas besoin d&apos;être exact&#xa0;: le recalage l&apos;affine.</translation>
    </message>
    <message>
        <source>LAO + / RAO -:</source>
        <translation>LAO + / RAO -&#xa0;:</translation>
    </message>
    <message>
        <source>Primary angle; positive with the detector toward the patient&apos;s left.</source>
        <translation>Angle primaire&#xa0;; positif quand le détecteur est vers la gauche du patient.</translation>
    </message>
    <message>
        <source> deg</source>
        <translation> °</translation>
    </message>
    <message>
        <source>CRA + / CAU -:</source>
        <translation>CRA + / CAU -&#xa0;:</translation>
    </message>
    <message>
        <source>Secondary angle; positive with the detector toward the head.</source>
        <translation>Angle secondaire&#xa0;; positif quand le détecteur est vers la tête.</translation>
    </message>
    <message>
        <source>Image rotation:</source>
        <translation>Rotation de l&apos;image&#xa0;:</translation>
    </message>
    <message>
        <source>Rotation of the detector about the beam.</source>
        <translation>Rotation du détecteur autour du faisceau.</translation>
    </message>
    <message>
        <source>Source to isocentre:</source>
        <translation>Source-isocentre&#xa0;:</translation>
    </message>
    <message>
        <source>Distance from the source to the isocentre.</source>
        <translation>Distance de la source à l&apos;isocentre.</translation>
    </message>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>Source to detector:</source>
        <translation>Source-détecteur&#xa0;:</translation>
    </message>
    <message>
        <source>Distance from the source to the detector.</source>
        <translation>Distance de la source au détecteur.</translation>
    </message>
    <message>
        <source>Table to the left:</source>
        <translation>Table vers la gauche&#xa0;:</translation>
    </message>
    <message>
        <source>How far the patient lies to his or her left of the isocentre.</source>
        <translation>De combien le patient se trouve à gauche (sa gauche) de l&apos;isocentre.</translation>
    </message>
    <message>
        <source>Table to the front:</source>
        <translation>Table vers l&apos;avant&#xa0;:</translation>
    </message>
    <message>
        <source>How far the patient lies to the front of the isocentre.</source>
        <translation>De combien le patient se trouve en avant de l&apos;isocentre.</translation>
    </message>
    <message>
        <source>Table to the head:</source>
        <translation>Table vers la tête&#xa0;:</translation>
    </message>
    <message>
        <source>How far the patient lies toward the head from the isocentre.</source>
        <translation>De combien le patient se trouve vers la tête par rapport à l&apos;isocentre.</translation>
    </message>
    <message>
        <source>Overlay:</source>
        <translation>Superposition&#xa0;:</translation>
    </message>
    <message>
        <source>How much of the rendering is seen over the X-ray.</source>
        <translation>Dans quelle mesure le rendu est visible sur la radiographie.</translation>
    </message>
    <message>
        <source> %</source>
        <translation>&#xa0;%</translation>
    </message>
    <message>
        <source>Show live</source>
        <translation>Afficher en direct</translation>
    </message>
    <message>
        <source>Render the CT over the selected X-ray while the sliders move.</source>
        <translation>Rendre le scanner sur la radiographie sélectionnée pendant que les curseurs bougent.</translation>
    </message>
    <message>
        <source>Back to what the X-ray&apos;s own geometry says.</source>
        <translation>Revenir à ce que dit la géométrie propre à la radiographie.</translation>
    </message>
    <message>
        <source>Reset</source>
        <translation>Réinitialiser</translation>
    </message>
    <message>
        <source>Use as initial camera</source>
        <translation>Utiliser comme caméra initiale</translation>
    </message>
    <message>
        <source>Start the registration of this X-ray from the camera that is shown.</source>
        <translation>Faire partir le recalage de cette radiographie de la caméra affichée.</translation>
    </message>
    <message>
        <source>5. Settings</source>
        <translation>5. Paramètres</translation>
    </message>
    <message>
        <source>Preset:</source>
        <translation>Préréglage&#xa0;:</translation>
    </message>
    <message>
        <source>How thorough the registration is.</source>
        <translation>Le degré de soin du recalage.</translation>
    </message>
    <message>
        <source>Compute on:</source>
        <translation>Calculer sur&#xa0;:</translation>
    </message>
    <message>
        <source>A graphics card is used when there is one, unless the processor is chosen.</source>
        <translation>La carte graphique est utilisée s&apos;il y en a une, sauf si le processeur est choisi.</translation>
    </message>
    <message>
        <source>Show the curve of the similarity beside the slices.</source>
        <translation>Afficher la courbe de similarité à côté des coupes.</translation>
    </message>
    <message>
        <source>Show the similarity in the layout</source>
        <translation>Afficher la similarité dans la disposition</translation>
    </message>
    <message>
        <source>Advanced</source>
        <translation>Avancé</translation>
    </message>
    <message>
        <source>Update the slices while it runs</source>
        <translation>Actualiser les coupes en cours</translation>
    </message>
    <message>
        <source>Refresh the transform while the registration runs.</source>
        <translation>Rafraîchir la transformation pendant que le recalage s&apos;exécute.</translation>
    </message>
    <message>
        <source>Refine the cameras</source>
        <translation>Affiner les caméras</translation>
    </message>
    <message>
        <source>Refine the cameras by aligning the anchor before the other bones move.</source>
        <translation>Affiner les caméras en alignant l&apos;ancre avant que les autres os ne bougent.</translation>
    </message>
    <message>
        <source>Compute uncertainty</source>
        <translation>Calculer l&apos;incertitude</translation>
    </message>
    <message>
        <source>Estimate the uncertainty of each motion; takes a little longer.</source>
        <translation>Estimer l&apos;incertitude de chaque mouvement&#xa0;; prend un peu plus de temps.</translation>
    </message>
    <message>
        <source>Threads:</source>
        <translation>Fils d&apos;exécution&#xa0;:</translation>
    </message>
    <message>
        <source>Number of processor threads.</source>
        <translation>Nombre de fils d&apos;exécution du processeur.</translation>
    </message>
    <message>
        <source>all</source>
        <translation>tous</translation>
    </message>
    <message>
        <source>Random seed:</source>
        <translation>Graine aléatoire&#xa0;:</translation>
    </message>
    <message>
        <source>The same seed gives the same result on the same machine.</source>
        <translation>La même graine donne le même résultat sur la même machine.</translation>
    </message>
    <message>
        <source>Keep the result folder in:</source>
        <translation>Conserver le résultat dans&#xa0;:</translation>
    </message>
    <message>
        <source>A new folder in which to keep result.json, the ITK transform and the images. Leave it empty to keep only the nodes in the scene.</source>
        <translation>Un nouveau dossier où conserver result.json, la transformation ITK et les images. Laissez vide pour ne garder que les nœuds de la scène.</translation>
    </message>
    <message>
        <source>6. Review</source>
        <translation>6. Vérification</translation>
    </message>
    <message>
        <source>Show PolyPose layout</source>
        <translation>Disposition PolyPose</translation>
    </message>
    <message>
        <source>X-rays in a row, the 3D view with the C-arms, and the three slices.</source>
        <translation>Les radiographies en rangée, la vue 3D avec les arceaux, et les trois coupes.</translation>
    </message>
    <message>
        <source>Load result...</source>
        <translation>Charger un résultat...</translation>
    </message>
    <message>
        <source>Open the folder of an earlier registration.</source>
        <translation>Ouvrir le dossier d&apos;un recalage antérieur.</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Défaire</translation>
    </message>
    <message>
        <source>Compare</source>
        <translation>Comparer</translation>
    </message>
    <message>
        <source>CT and bones</source>
        <translation>Scanner et os</translation>
    </message>
    <message>
        <source>Before (as in the CT)</source>
        <translation>Avant (scanner)</translation>
    </message>
    <message>
        <source>Show the CT and its segmentation where they were scanned (Ctrl+Shift+B swaps).</source>
        <translation>Afficher le scanner et sa segmentation là où ils ont été acquis (Ctrl+Shift+B permute).</translation>
    </message>
    <message>
        <source>After (as in the X-rays)</source>
        <translation>Après (radiographies)</translation>
    </message>
    <message>
        <source>Show the CT and its segmentation in the posture of the X-rays, through the transform.</source>
        <translation>Afficher le scanner et sa segmentation dans la posture des radiographies, à travers la transformation.</translation>
    </message>
    <message>
        <source>Only the bones that move</source>
        <translation>Os mobiles seulement</translation>
    </message>
    <message>
        <source>Hide the segments that belong to no structure.</source>
        <translation>Masquer les segments qui n&apos;appartiennent à aucune structure.</translation>
    </message>
    <message>
        <source>Bones in 3D</source>
        <translation>Os en 3D</translation>
    </message>
    <message>
        <source>Show the bones that move as surfaces in the 3D view, where the chosen posture has them.</source>
        <translation>Afficher les os mobiles comme surfaces dans la vue 3D, tels qu&apos;ils sont dans la posture choisie.</translation>
    </message>
    <message>
        <source>X-ray versus rendering</source>
        <translation>Radiographie et rendu</translation>
    </message>
    <message>
        <source>View:</source>
        <translation>Vue&#xa0;:</translation>
    </message>
    <message>
        <source>The X-ray to compare with its rendering.</source>
        <translation>La radiographie à comparer à son rendu.</translation>
    </message>
    <message>
        <source>Compare by:</source>
        <translation>Comparer par&#xa0;:</translation>
    </message>
    <message>
        <source>How X-ray and rendering are shown in one image.</source>
        <translation>Comment la radiographie et le rendu sont montrés dans une même image.</translation>
    </message>
    <message>
        <source>Blend</source>
        <translation>Fondu</translation>
    </message>
    <message>
        <source>Checkerboard</source>
        <translation>Damier</translation>
    </message>
    <message>
        <source>Flicker</source>
        <translation>Clignotement</translation>
    </message>
    <message>
        <source>Edges of the rendering</source>
        <translation>Contours du rendu</translation>
    </message>
    <message>
        <source>X-ray alone</source>
        <translation>Radiographie seule</translation>
    </message>
    <message>
        <source>Rendering alone</source>
        <translation>Rendu seul</translation>
    </message>
    <message>
        <source>Amount:</source>
        <translation>Intensité&#xa0;:</translation>
    </message>
    <message>
        <source>Share of the rendering in a blend; size of the squares; strength of the edges.</source>
        <translation>Part du rendu dans le fondu&#xa0;; taille des carrés&#xa0;; force des contours.</translation>
    </message>
    <message>
        <source>Seen from the detector, as C-arms display</source>
        <translation>Vu depuis le détecteur, comme sur les arceaux</translation>
    </message>
    <message>
        <source>Off: as seen from the X-ray source.</source>
        <translation>Désactivé&#xa0;: vu depuis la source de rayons X.</translation>
    </message>
    <message>
        <source>Deformation</source>
        <translation>Déformation</translation>
    </message>
    <message>
        <source>Grid</source>
        <translation>Grille</translation>
    </message>
    <message>
        <source>Show the deformation as a grid, in the slices.</source>
        <translation>Afficher la déformation comme grille dans les coupes.</translation>
    </message>
    <message>
        <source>Show the deformation as arrows, in the slices and in 3D.</source>
        <translation>Afficher la déformation par des flèches dans les coupes et en 3D.</translation>
    </message>
    <message>
        <source>Arrows</source>
        <translation>Flèches</translation>
    </message>
    <message>
        <source>One row per X-ray: where its geometry comes from and how reliable it is. Image files, and loaded X-rays from a tree of the data, can be dropped here.</source>
        <translation>Une ligne par radiographie : d&apos;où vient sa géométrie et quelle est sa fiabilité. On peut déposer ici des fichiers d&apos;image et des radiographies chargées depuis une arborescence de données.</translation>
    </message>
    <message>
        <source>Volume change</source>
        <translation>Variation de volume</translation>
    </message>
    <message>
        <source>Show by colour where tissue grows or shrinks (Jacobian determinant); folds are marked.</source>
        <translation>Montrer par des couleurs où le tissu grandit ou rétrécit (déterminant jacobien)&#xa0;; les replis sont marqués.</translation>
    </message>
    <message>
        <source>Weight of:</source>
        <translation>Poids de&#xa0;:</translation>
    </message>
    <message>
        <source>Show how strongly a structure&apos;s motion influences each point.</source>
        <translation>Montrer avec quelle force le mouvement d&apos;une structure influence chaque point.</translation>
    </message>
    <message>
        <source>Motions</source>
        <translation>Mouvements</translation>
    </message>
    <message>
        <source>Motions of the bones</source>
        <translation>Mouvements des os</translation>
    </message>
    <message>
        <source>Relative to:</source>
        <translation>Par rapport à&#xa0;:</translation>
    </message>
    <message>
        <source>Motions are shown as seen from this structure.</source>
        <translation>Les mouvements sont montrés tels que vus depuis cette structure.</translation>
    </message>
    <message>
        <source>Rotation, displacement of the centroid and axis of each structure, from the CT to the X-rays.</source>
        <translation>Rotation, déplacement du centroïde et axe de chaque structure, du scanner aux radiographies.</translation>
    </message>
    <message>
        <source>Copy</source>
        <translation>Copier</translation>
    </message>
    <message>
        <source>Copy the table, ready to be pasted into a spreadsheet.</source>
        <translation>Copier le tableau, prêt à être collé dans un tableur.</translation>
    </message>
    <message>
        <source>Save as CSV...</source>
        <translation>Enregistrer en CSV...</translation>
    </message>
    <message>
        <source>Write the table into a file.</source>
        <translation>Écrire le tableau dans un fichier.</translation>
    </message>
    <message>
        <source>Save report...</source>
        <translation>Rapport...</translation>
    </message>
    <message>
        <source>Write one HTML page with inputs, motions, pictures and warnings.</source>
        <translation>Écrire une page HTML avec les entrées, les mouvements, les images et les avertissements.</translation>
    </message>
    <message>
        <source>Save result as a scene...</source>
        <translation>Scène...</translation>
    </message>
    <message>
        <source>Write the CT, its segmentation and the result alone into a scene of their own (.mrb), which opens in any Slicer, without this module too.</source>
        <translation>Écrire seulement le scanner, sa segmentation et le résultat dans une scène à part (.mrb), qui s&apos;ouvre dans tout Slicer, même sans ce module.</translation>
    </message>
    <message>
        <source>Carry</source>
        <translation>Emporter</translation>
    </message>
    <message>
        <source>Carry along</source>
        <translation>Emporter</translation>
    </message>
    <message>
        <source>Markups, models, segmentations, volumes and RT doses of the CT: what is checked follows Before and After, and the registration while it runs.</source>
        <translation>Marqueurs, modèles, segmentations, volumes et doses RT du scanner&#xa0;: ce qui est coché suit Avant et Après, et le recalage pendant son exécution.</translation>
    </message>
    <message>
        <source>95 % ellipsoids of points</source>
        <translation>Ellipsoïdes à 95 % des points</translation>
    </message>
    <message>
        <source>How far each carried point may be off, in 3D and in the slices; shown with After.</source>
        <translation>De combien chaque point emporté peut s&apos;écarter, en 3D et dans les coupes&#xa0;; affiché avec Après.</translation>
    </message>
    <message>
        <source>Result for planning systems</source>
        <translation>Résultat pour les systèmes de planification</translation>
    </message>
    <message>
        <source>Export as DICOM...</source>
        <translation>Exporter en DICOM...</translation>
    </message>
    <message>
        <source>Write the warped CT, the segmentation, every bone&apos;s motion and the deformation as DICOM objects, for planning systems.</source>
        <translation>Écrire le scanner déformé, la segmentation, le mouvement de chaque os et la déformation en objets DICOM, pour les systèmes de planification.</translation>
    </message>
    <message>
        <source>Adjust</source>
        <translation>Ajuster</translation>
    </message>
    <message>
        <source>Bones moved by hand</source>
        <translation>Os déplacés à la main</translation>
    </message>
    <message>
        <source>The bone that the handles move.</source>
        <translation>L&apos;os que les poignées déplacent.</translation>
    </message>
    <message>
        <source>Show handles</source>
        <translation>Afficher les poignées</translation>
    </message>
    <message>
        <source>Show Slicer&apos;s handles on this bone, in 3D and in the slices, and its outline on the X-rays.</source>
        <translation>Afficher les poignées de Slicer sur cet os, en 3D et dans les coupes, et son contour sur les radiographies.</translation>
    </message>
    <message>
        <source>Put back</source>
        <translation>Remettre</translation>
    </message>
    <message>
        <source>Put all bones back where the result has them.</source>
        <translation>Remettre tous les os là où le résultat les place.</translation>
    </message>
    <message>
        <source>Refine from here</source>
        <translation>Affiner à partir d&apos;ici</translation>
    </message>
    <message>
        <source>Fit cameras and bones again from where they are now; Undo brings this result back.</source>
        <translation>Ajuster de nouveau les caméras et les os à partir de leur place actuelle&#xa0;; «&#xa0;Défaire&#xa0;» ramène ce résultat.</translation>
    </message>
    <message>
        <source>7. Motion</source>
        <translation>7. Mouvement</translation>
    </message>
    <message>
        <source>Frames per second:</source>
        <translation>Images par seconde :</translation>
    </message>
    <message>
        <source>Of all cameras. Where it is left alone, it is what DICOM or the times of the images state.</source>
        <translation>De toutes les caméras. Sans saisie, c&apos;est la valeur qu&apos;indiquent DICOM ou les temps des images.</translation>
    </message>
    <message>
        <source>as the images state</source>
        <translation>comme les images l&apos;indiquent</translation>
    </message>
    <message>
        <source>Frames:</source>
        <translation>Instants :</translation>
    </message>
    <message>
        <source>The first frame that is tracked, counted from 0. Frame 0 is the first that all cameras have; the images that the X-rays show (Frame) belong together.</source>
        <translation>Le premier instant suivi, compté à partir de 0. L&apos;instant 0 est le premier que toutes les caméras possèdent ; les images que montrent les radiographies (Image) vont ensemble.</translation>
    </message>
    <message>
        <source>to</source>
        <translation>à</translation>
    </message>
    <message>
        <source>The last frame that is tracked.</source>
        <translation>Le dernier instant suivi.</translation>
    </message>
    <message>
        <source>Reference:</source>
        <translation>Référence :</translation>
    </message>
    <message>
        <source>The structure relative to which the motion of the others is reported; it moves, too.</source>
        <translation>La structure par rapport à laquelle le mouvement des autres est donné ; elle bouge aussi.</translation>
    </message>
    <message>
        <source>Start:</source>
        <translation>Départ :</translation>
    </message>
    <message>
        <source>Where the bones are looked for in the first frame.</source>
        <translation>Où les os sont cherchés au premier instant.</translation>
    </message>
    <message>
        <source>Standing still:</source>
        <translation>Immobiles :</translation>
    </message>
    <message>
        <source>Structures that do not move during the sequence.</source>
        <translation>Structures qui ne bougent pas pendant la séquence.</translation>
    </message>
    <message>
        <source>Go back once more, and keep the better poses</source>
        <translation>Revenir en arrière et garder les meilleures poses</translation>
    </message>
    <message>
        <source>A second pass goes from the last frame to the first; it finds bones again that were lost behind others.</source>
        <translation>Un second passage va du dernier instant au premier ; il retrouve des os perdus derrière d&apos;autres.</translation>
    </message>
    <message>
        <source>Smooth the poses</source>
        <translation>Lisser les poses</translation>
    </message>
    <message>
        <source>Smooth the poses with their own uncertainty. A smoothed track cannot be corrected afterwards.</source>
        <translation>Lisser les poses avec leur propre incertitude. Un suivi lissé ne peut plus être corrigé ensuite.</translation>
    </message>
    <message>
        <source>Track</source>
        <translation>Suivre</translation>
    </message>
    <message>
        <source>Go on</source>
        <translation>Reprendre</translation>
    </message>
    <message>
        <source>Go on with the frames that the interrupted tracking has left.</source>
        <translation>Continuer avec les instants que le suivi interrompu a laissés.</translation>
    </message>
    <message>
        <source>Tracked</source>
        <translation>Suivi</translation>
    </message>
    <message>
        <source>Previous doubtful</source>
        <translation>Douteux précédent</translation>
    </message>
    <message>
        <source>Go to the frame before this one whose poses are doubtful.</source>
        <translation>Aller à l&apos;instant précédent dont les poses sont douteuses.</translation>
    </message>
    <message>
        <source>Next doubtful</source>
        <translation>Douteux suivant</translation>
    </message>
    <message>
        <source>Go to the frame after this one whose poses are doubtful.</source>
        <translation>Aller à l&apos;instant suivant dont les poses sont douteuses.</translation>
    </message>
    <message>
        <source>The bone that is corrected.</source>
        <translation>L&apos;os qui est corrigé.</translation>
    </message>
    <message>
        <source>Correct</source>
        <translation>Corriger</translation>
    </message>
    <message>
        <source>Show handles on this bone: drag it until its outlines match the X-rays. It belongs to this frame, and is kept when you go to another one.</source>
        <translation>Afficher des poignées sur cet os : le déplacer jusqu&apos;à ce que ses contours correspondent aux radiographies. La correction appartient à cet instant et reste quand on passe à un autre.</translation>
    </message>
    <message>
        <source>Undo correction</source>
        <translation>Annuler</translation>
    </message>
    <message>
        <source>Put the bone back where the track has it in this frame.</source>
        <translation>Remettre l&apos;os où le suivi le place à cet instant.</translation>
    </message>
    <message>
        <source>Which frames are tracked anew from the corrected one on.</source>
        <translation>Quels instants sont suivis à nouveau à partir de l&apos;instant corrigé.</translation>
    </message>
    <message>
        <source>Track on from here</source>
        <translation>Suivre à partir d&apos;ici</translation>
    </message>
    <message>
        <source>Track anew from the bones that were corrected in this frame; other frames are kept.</source>
        <translation>Suivre à nouveau à partir des os corrigés à cet instant ; les autres instants sont conservés.</translation>
    </message>
    <message>
        <source>Show plots</source>
        <translation>Afficher les courbes</translation>
    </message>
    <message>
        <source>Show the X-rays with outlines, the bones, and plots of their motion.</source>
        <translation>Afficher les radiographies avec les contours, les os et les courbes de leur mouvement.</translation>
    </message>
    <message>
        <source>Save track...</source>
        <translation>Enregistrer le suivi...</translation>
    </message>
    <message>
        <source>Write the track into a folder, as the command line does.</source>
        <translation>Écrire le suivi dans un dossier, comme le fait la ligne de commande.</translation>
    </message>
    <message>
        <source>Register</source>
        <translation>Recaler</translation>
    </message>
</context>
<context>
    <name>PolyPoseSlicer.calls</name>
    <message>
        <source>There is no result whose bones could be refined: register first.</source>
        <translation>Il n&apos;y a pas de résultat dont les os pourraient être affinés&#xa0;: lancez d&apos;abord un recalage.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is both an input and an output: choose another node for the output.</source>
        <translation>«&#xa0;{name}&#xa0;» est à la fois une entrée et une sortie&#xa0;: choisissez un autre nœud pour la sortie.</translation>
    </message>
</context>
<context>
    <name>PolyPoseSlicer.samples</name>
    <message>
        <source>PolyPose simulates two X-rays of the sample...</source>
        <translation>PolyPose simule deux radiographies de l&apos;exemple...</translation>
    </message>
    <message>
        <source>{program} could not be started ({reason}): install Slicer again.</source>
        <translation>{program} n&apos;a pas pu démarrer ({reason})&#xa0;: réinstallez Slicer.</translation>
    </message>
</context>
<context>
    <name>panel.adjustment</name>
    <message>
        <source>Move a bone with the handles in 3D and in the slices: its outline on the X-rays follows. Then refine: all bones are fitted from where they are, and none is looked for elsewhere.</source>
        <translation>Déplacez un os avec les poignées en 3D et dans les coupes&#xa0;: son contour sur les radiographies suit. Puis affinez&#xa0;: tous les os sont ajustés à partir de leur place, et aucun n&apos;est cherché ailleurs.</translation>
    </message>
    <message>
        <source>Bones can be adjusted once there is a result.</source>
        <translation>Les os peuvent être ajustés dès qu&apos;il y a un résultat.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; has no voxel in the warped segmentation: register again, or choose another bone.</source>
        <translation>«&#xa0;{name}&#xa0;» n&apos;a aucun voxel dans la segmentation déformée&#xa0;: recalez de nouveau, ou choisissez un autre os.</translation>
    </message>
</context>
<context>
    <name>panel.camera_text</name>
    <message>
        <source>No other view scores nearly as high.</source>
        <translation>Aucune autre vue n&apos;obtient un score proche.</translation>
    </message>
    <message>
        <source>This X-ray is not ready: complete its geometry above.</source>
        <translation>Cette radiographie n&apos;est pas prête&#xa0;: complétez sa géométrie ci-dessus.</translation>
    </message>
    <message>
        <source>The pose in the calibration is used; it must be given in the CT&apos;s coordinates (LPS, mm).</source>
        <translation>La pose de l&apos;étalonnage est utilisée&#xa0;; elle doit être donnée dans les coordonnées du scanner (LPS, mm).</translation>
    </message>
    <message>
        <source>Its file gives no angles: choose another camera source.</source>
        <translation>Son fichier ne donne aucun angle&#xa0;: choisissez une autre source de caméra.</translation>
    </message>
    <message>
        <source>Choose the model file; python -m PolyPoseLib train makes one for this CT.</source>
        <translation>Choisissez le fichier du modèle&#xa0;; python -m PolyPoseLib train en crée un pour ce scanner.</translation>
    </message>
    <message>
        <source>Not searched for yet: press Find camera, or the registration will search when it starts.</source>
        <translation>Pas encore cherchée&#xa0;: appuyez sur «&#xa0;Trouver la caméra&#xa0;», sinon le recalage cherchera au démarrage.</translation>
    </message>
    <message>
        <source>Found: {how}.</source>
        <translation>Trouvée&#xa0;: {how}.</translation>
    </message>
    <message>
        <source>Expected accuracy: {degrees:.0f} deg and {mm:.0f} mm.</source>
        <translation>Précision attendue&#xa0;: {degrees:.0f}° et {mm:.0f} mm.</translation>
    </message>
    <message>
        <source>It is uncertain, and in use because you accepted it.</source>
        <translation>Elle est incertaine, et utilisée parce que vous l&apos;avez acceptée.</translation>
    </message>
    <message>
        <source>It is uncertain and not in use: show it, then accept or discard it.</source>
        <translation>Elle est incertaine et n&apos;est pas utilisée&#xa0;: affichez-la, puis acceptez-la ou rejetez-la.</translation>
    </message>
    <message>
        <source>Choose the calibration file.</source>
        <translation>Choisissez le fichier d&apos;étalonnage.</translation>
    </message>
</context>
<context>
    <name>panel.cameras</name>
    <message>
        <source>Find camera</source>
        <translation>Trouver la caméra</translation>
    </message>
    <message>
        <source>all directions</source>
        <translation>toutes les directions</translation>
    </message>
    <message>
        <source>Calibration files</source>
        <translation>Fichiers d&apos;étalonnage</translation>
    </message>
    <message>
        <source>All files</source>
        <translation>Tous les fichiers</translation>
    </message>
    <message>
        <source>Every X-ray already has an initial camera.</source>
        <translation>Chaque radiographie a déjà une caméra initiale.</translation>
    </message>
    <message>
        <source>{count} found.</source>
        <translation>{count} trouvée(s).</translation>
    </message>
    <message>
        <source>X-rays that you changed meanwhile were left as they are.</source>
        <translation>Les radiographies que vous avez modifiées entre-temps ont été laissées telles quelles.</translation>
    </message>
    <message>
        <source>Preparing the data...</source>
        <translation>Préparation des données...</translation>
    </message>
    <message>
        <source>Select an X-ray in the table.</source>
        <translation>Sélectionnez une radiographie dans le tableau.</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Annulation...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Annuler</translation>
    </message>
    <message>
        <source>Stop the search; nothing is changed.</source>
        <translation>Arrêter la recherche&#xa0;; rien n&apos;est modifié.</translation>
    </message>
    <message>
        <source>This camera source needs no search.</source>
        <translation>Cette source de caméra ne demande aucune recherche.</translation>
    </message>
    <message>
        <source>Choose the model file.</source>
        <translation>Choisissez le fichier du modèle.</translation>
    </message>
    <message>
        <source>Find the camera of the selected X-ray.</source>
        <translation>Trouver la caméra de la radiographie sélectionnée.</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Annulé&#xa0;; rien n&apos;a été modifié.</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>Démarrage...</translation>
    </message>
    <message>
        <source>Camera of {name}</source>
        <translation>Caméra de {name}</translation>
    </message>
    <message>
        <source>{count} uncertain and not in use: select the X-ray and review it.</source>
        <translation>{count} incertaine(s) et non utilisée(s)&#xa0;: sélectionnez la radiographie et vérifiez sa caméra.</translation>
    </message>
    <message>
        <source>{stage}: {iteration} of {of}</source>
        <translation>{stage}&#xa0;: {iteration} sur {of}</translation>
    </message>
</context>
<context>
    <name>panel.carm</name>
    <message>
        <source>Preparing the CT...</source>
        <translation>Préparation du scanner...</translation>
    </message>
    <message>
        <source>The registration of &apos;{name}&apos; will start from this camera.</source>
        <translation>Le recalage de «&#xa0;{name}&#xa0;» partira de cette caméra.</translation>
    </message>
    <message>
        <source>Choose the CT first.</source>
        <translation>Choisissez d&apos;abord le scanner.</translation>
    </message>
    <message>
        <source>Select an X-ray that is ready.</source>
        <translation>Sélectionnez une radiographie prête.</translation>
    </message>
    <message>
        <source>Live ({milliseconds:.0f} ms per image).</source>
        <translation>En direct ({milliseconds:.0f} ms par image).</translation>
    </message>
    <message>
        <source>Initial camera of {name}</source>
        <translation>Caméra initiale de {name}</translation>
    </message>
</context>
<context>
    <name>panel.carry</name>
    <message>
        <source>Is put under the result&apos;s transform while After is shown, and back for Before.</source>
        <translation>Est placé sous la transformation du résultat tant qu&apos;Après est affiché, et remis à sa place pour Avant.</translation>
    </message>
    <message>
        <source>Computing...</source>
        <translation>Calcul...</translation>
    </message>
    <message>
        <source>Points inside a bone take the bone&apos;s own motion; all others, the displacement field. The markups themselves stay as they are: copies of them are shown.</source>
        <translation>Les points situés dans un os suivent le mouvement de cet os&#xa0;; les autres, le champ de déplacement. Les marqueurs eux-mêmes ne changent pas&#xa0;: des copies sont affichées.</translation>
    </message>
    <message>
        <source>Nothing to carry: load or make markups, models, segmentations or volumes of the CT.</source>
        <translation>Rien à emporter&#xa0;: chargez ou créez des marqueurs, modèles, segmentations ou volumes du scanner.</translation>
    </message>
    <message>
        <source>Points follow the displacement field alone: {reason}</source>
        <translation>Les points suivent seulement le champ de déplacement&#xa0;: {reason}</translation>
    </message>
    <message>
        <source>Check what shall follow Before and After.</source>
        <translation>Cochez ce qui doit suivre Avant et Après.</translation>
    </message>
    <message>
        <source>Choose After in the tab Compare to see it in the posture of the X-rays.</source>
        <translation>Choisissez Après dans l&apos;onglet Comparer pour le voir dans la posture des radiographies.</translation>
    </message>
    <message>
        <source>Shown in the posture of the X-rays.</source>
        <translation>Affiché dans la posture des radiographies.</translation>
    </message>
</context>
<context>
    <name>panel.export</name>
    <message>
        <source>Added to Slicer&apos;s DICOM database.</source>
        <translation>Ajouté à la base de données DICOM de Slicer.</translation>
    </message>
    <message>
        <source>Writing DICOM...</source>
        <translation>Écriture DICOM...</translation>
    </message>
    <message>
        <source>Export as DICOM...</source>
        <translation>Exporter en DICOM...</translation>
    </message>
    <message>
        <source>Export as DICOM into a folder</source>
        <translation>Exporter en DICOM dans un dossier</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Annuler</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Annulé&#xa0;; rien n&apos;a été modifié.</translation>
    </message>
    <message>
        <source>Add the exported DICOM objects to Slicer&apos;s DICOM database?</source>
        <translation>Ajouter les objets DICOM exportés à la base de données DICOM de Slicer&#xa0;?</translation>
    </message>
    <message>
        <source>Stop the export; nothing is written.</source>
        <translation>Arrêter l&apos;exportation&#xa0;; rien n&apos;est écrit.</translation>
    </message>
    <message>
        <source>Write the warped CT, the segmentation, every bone&apos;s motion and the deformation as DICOM objects, for planning systems.</source>
        <translation>Écrire le scanner déformé, la segmentation, le mouvement de chaque os et la déformation en objets DICOM, pour les systèmes de planification.</translation>
    </message>
    <message>
        <source>Written to {folder}.</source>
        <translation>Écrit dans {folder}.</translation>
    </message>
    <message>
        <source>Export as DICOM</source>
        <translation>Exporter en DICOM</translation>
    </message>
    <message>
        <source>Slicer&apos;s DICOM module could not add them ({reason}): add the folder there.</source>
        <translation>Le module DICOM de Slicer n&apos;a pas pu les ajouter ({reason})&#xa0;: ajoutez-y le dossier.</translation>
    </message>
    <message>
        <source>The CT is not in Slicer&apos;s DICOM database: everything, the CT too, was written for the placeholder patient {name}.</source>
        <translation>Le scanner n&apos;est pas dans la base de données DICOM de Slicer&#xa0;: tout, le scanner aussi, a été écrit pour le patient fictif {name}.</translation>
    </message>
</context>
<context>
    <name>panel.landmark_table</name>
    <message>
        <source>Landmark</source>
        <translation>Repère</translation>
    </message>
    <message>
        <source>Error [mm]</source>
        <translation>Erreur [mm]</translation>
    </message>
    <message>
        <source>Error [px]</source>
        <translation>Erreur [px]</translation>
    </message>
    <message>
        <source>State</source>
        <translation>État</translation>
    </message>
    <message>
        <source>only in the CT</source>
        <translation>seulement dans le scanner</translation>
    </message>
    <message>
        <source>only in the X-ray</source>
        <translation>seulement dans la radiographie</translation>
    </message>
    <message>
        <source>not on the X-ray</source>
        <translation>hors de la radiographie</translation>
    </message>
    <message>
        <source>pending</source>
        <translation>en attente</translation>
    </message>
    <message>
        <source>used</source>
        <translation>utilisé</translation>
    </message>
    <message>
        <source>excluded: inconsistent with the others</source>
        <translation>exclu&#xa0;: incohérent avec les autres</translation>
    </message>
</context>
<context>
    <name>panel.landmarks</name>
    <message>
        <source>Slicer has no main window to show the views in.</source>
        <translation>Slicer n&apos;a pas de fenêtre principale où afficher les vues.</translation>
    </message>
    <message>
        <source>{name}: landmarks in the CT</source>
        <translation>{name}&#xa0;: repères dans le scanner</translation>
    </message>
    <message>
        <source>{name}: landmarks in the X-ray</source>
        <translation>{name}&#xa0;: repères dans la radiographie</translation>
    </message>
    <message>
        <source>projected landmarks</source>
        <translation>repères projetés</translation>
    </message>
    <message>
        <source>Camera of {name} by landmarks</source>
        <translation>Caméra de {name} d&apos;après les repères</translation>
    </message>
    <message>
        <source>Only the first {count} X-rays can be shown: remove another one first.</source>
        <translation>Seules les {count} premières radiographies peuvent être affichées&#xa0;: retirez-en d&apos;abord une autre.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is already used by another X-ray or by the CT: each X-ray needs a list of its own.</source>
        <translation>«&#xa0;{name}&#xa0;» est déjà utilisé par une autre radiographie ou par le scanner&#xa0;: chaque radiographie a besoin de sa propre liste.</translation>
    </message>
    <message>
        <source>{name}: pixels</source>
        <translation>{name}&#xa0;: pixels</translation>
    </message>
</context>
<context>
    <name>panel.maps</name>
    <message>
        <source>Computing...</source>
        <translation>Calcul...</translation>
    </message>
    <message>
        <source>nothing</source>
        <translation>rien</translation>
    </message>
    <message>
        <source>Black: &apos;{name}&apos; has no influence; yellow: only &apos;{name}&apos; has.</source>
        <translation>Noir&#xa0;: «&#xa0;{name}&#xa0;» n&apos;a aucune influence&#xa0;; jaune&#xa0;: seul «&#xa0;{name}&#xa0;» en a.</translation>
    </message>
</context>
<context>
    <name>panel.motions</name>
    <message>
        <source>Displacement [mm]</source>
        <translation>Déplacement [mm]</translation>
    </message>
    <message>
        <source>Rotation [deg]</source>
        <translation>Rotation [deg]</translation>
    </message>
    <message>
        <source>Right [mm]</source>
        <translation>Droite [mm]</translation>
    </message>
    <message>
        <source>Anterior [mm]</source>
        <translation>Antérieur [mm]</translation>
    </message>
    <message>
        <source>Superior [mm]</source>
        <translation>Supérieur [mm]</translation>
    </message>
    <message>
        <source>Axis (R, A, S)</source>
        <translation>Axe (R, A, S)</translation>
    </message>
    <message>
        <source>Uncertainty</source>
        <translation>Incertitude</translation>
    </message>
    <message>
        <source>Doubts</source>
        <translation>Doutes</translation>
    </message>
    <message>
        <source>Structure</source>
        <translation>Structure</translation>
    </message>
    <message>
        <source>Save motions</source>
        <translation>Enregistrer les mouvements</translation>
    </message>
    <message>
        <source>Tables (*.csv)</source>
        <translation>Tableaux (*.csv)</translation>
    </message>
    <message>
        <source>the CT (absolute)</source>
        <translation>le scanner (absolu)</translation>
    </message>
    <message>
        <source>Relative to {name}</source>
        <translation>Par rapport à {name}</translation>
    </message>
    <message>
        <source>{path} cannot be written ({reason}): choose another folder.</source>
        <translation>Impossible d&apos;écrire {path} ({reason})&#xa0;: choisissez un autre dossier.</translation>
    </message>
</context>
<context>
    <name>panel.register</name>
    <message>
        <source>Register</source>
        <translation>Recaler</translation>
    </message>
    <message>
        <source>Preparing the data...</source>
        <translation>Préparation des données...</translation>
    </message>
    <message>
        <source>Reading the result...</source>
        <translation>Lecture du résultat...</translation>
    </message>
    <message>
        <source>Done in {seconds:.0f} s on {device}.</source>
        <translation>Terminé en {seconds:.0f} s sur {device}.</translation>
    </message>
    <message>
        <source>PolyPose similarity</source>
        <translation>PolyPose similarité</translation>
    </message>
    <message>
        <source>PolyPose similarity curve</source>
        <translation>PolyPose courbe de similarité</translation>
    </message>
    <message>
        <source>PolyPose similarity plot</source>
        <translation>PolyPose graphique de similarité</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Annulation...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Annuler</translation>
    </message>
    <message>
        <source>Stop the registration; nothing is changed.</source>
        <translation>Arrêter le recalage&#xa0;; rien n&apos;est modifié.</translation>
    </message>
    <message>
        <source>Align the CT to the X-rays.</source>
        <translation>Aligner le scanner sur les radiographies.</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Annulé&#xa0;; rien n&apos;a été modifié.</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>Démarrage...</translation>
    </message>
    <message>
        <source>this computer</source>
        <translation>cet ordinateur</translation>
    </message>
    <message>
        <source>Ready: {bones} structures, {xrays} X-rays.</source>
        <translation>Prêt&#xa0;: {bones} structures, {xrays} radiographies.</translation>
    </message>
</context>
<context>
    <name>panel.report_page</name>
    <message>
        <source>PolyPose report</source>
        <translation>Rapport PolyPose</translation>
    </message>
    <message>
        <source>Research software, not for clinical decisions.</source>
        <translation>Logiciel de recherche, non destiné aux décisions cliniques.</translation>
    </message>
    <message>
        <source>Do not trust this result: {why}</source>
        <translation>Ne vous fiez pas à ce résultat&#xa0;: {why}</translation>
    </message>
    <message>
        <source>X-rays and renderings</source>
        <translation>Radiographies et rendus</translation>
    </message>
    <message>
        <source>Summary</source>
        <translation>Résumé</translation>
    </message>
    <message>
        <source>Motions of the bones</source>
        <translation>Mouvements des os</translation>
    </message>
</context>
<context>
    <name>panel.review</name>
    <message>
        <source>No result yet: register, or load an earlier result.</source>
        <translation>Pas encore de résultat&#xa0;: lancez un recalage, ou chargez un résultat antérieur.</translation>
    </message>
    <message>
        <source>all</source>
        <translation>toutes</translation>
    </message>
    <message>
        <source>Slicer has no main window to show the views in.</source>
        <translation>Slicer n&apos;a pas de fenêtre principale où afficher les vues.</translation>
    </message>
    <message>
        <source>Load a result folder</source>
        <translation>Charger un dossier de résultat</translation>
    </message>
</context>
<context>
    <name>panel.saving</name>
    <message>
        <source>Save report</source>
        <translation>Enregistrer le rapport</translation>
    </message>
    <message>
        <source>HTML pages (*.html)</source>
        <translation>Pages HTML (*.html)</translation>
    </message>
    <message>
        <source>Save result as a scene</source>
        <translation>Enregistrer le résultat comme scène</translation>
    </message>
    <message>
        <source>Scenes (*.mrb)</source>
        <translation>Scènes (*.mrb)</translation>
    </message>
    <message>
        <source>{voxels} voxels of {spacing} mm</source>
        <translation>{voxels} voxels de {spacing} mm</translation>
    </message>
    <message>
        <source>CT</source>
        <translation>Scanner</translation>
    </message>
    <message>
        <source>Structures</source>
        <translation>Structures</translation>
    </message>
    <message>
        <source>Anchor</source>
        <translation>Ancre</translation>
    </message>
    <message>
        <source>Preset</source>
        <translation>Préréglage</translation>
    </message>
    <message>
        <source>Computed on</source>
        <translation>Calculé sur</translation>
    </message>
    <message>
        <source>Computing time [s]</source>
        <translation>Temps de calcul [s]</translation>
    </message>
    <message>
        <source>X-ray</source>
        <translation>Radiographie</translation>
    </message>
    <message>
        <source>rendering</source>
        <translation>rendu</translation>
    </message>
    <message>
        <source>edges</source>
        <translation>contours</translation>
    </message>
    <message>
        <source>{path} cannot be written ({reason}): choose another folder.</source>
        <translation>Impossible d&apos;écrire {path} ({reason})&#xa0;: choisissez un autre dossier.</translation>
    </message>
    <message>
        <source>similarity {n:.4f}</source>
        <translation>similarité {n:.4f}</translation>
    </message>
</context>
<context>
    <name>panel.segment_bones</name>
    <message>
        <source>starting</source>
        <translation>démarrage</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Annulation...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Annuler</translation>
    </message>
    <message>
        <source>Stop the segmentation; nothing is changed.</source>
        <translation>Arrêter la segmentation ; rien n&apos;est modifié.</translation>
    </message>
    <message>
        <source>{name} could not segment the CT ({reason}): see the application&apos;s log.</source>
        <translation>{name} n&apos;a pas pu segmenter le scanner ({reason}) : voir le journal de l&apos;application.</translation>
    </message>
    <message>
        <source>Segment bones</source>
        <translation>Segmenter</translation>
    </message>
    <message>
        <source>{name} ended with the code {code}: see the application&apos;s log.</source>
        <translation>{name} s&apos;est terminé avec le code {code} : voir le journal de l&apos;application.</translation>
    </message>
    <message>
        <source>{name} is installing what it needs...</source>
        <translation>{name} installe ce dont il a besoin...</translation>
    </message>
    <message>
        <source>The CT was deleted meanwhile: choose another.</source>
        <translation>Le scanner a été supprimé entre-temps : choisissez-en un autre.</translation>
    </message>
    <message>
        <source>{ct} bones</source>
        <translation>{ct} os</translation>
    </message>
    <message>
        <source>Segmented with {name}: check the bones and their structures.</source>
        <translation>Segmenté avec {name} : vérifiez les os et leurs structures.</translation>
    </message>
    <message>
        <source>Segment the CT with the extension TotalSegmentator or MONAIAuto3DSeg, and propose the structures.</source>
        <translation>Segmenter le scanner avec l&apos;extension TotalSegmentator ou MONAIAuto3DSeg et proposer les structures.</translation>
    </message>
    <message>
        <source>Choose the CT first.</source>
        <translation>Choisissez d&apos;abord le scanner.</translation>
    </message>
    <message>
        <source>{name} found nothing in &apos;{ct}&apos;: is it a CT in Hounsfield units?</source>
        <translation>{name} n&apos;a rien trouvé dans « {ct} » : est-ce un scanner en unités Hounsfield ?</translation>
    </message>
    <message>
        <source>&apos;{node}&apos; is ready; another CT is chosen by now.</source>
        <translation>« {node} » est prêt ; un autre scanner est choisi entre-temps.</translation>
    </message>
    <message>
        <source>{name}: {line}</source>
        <translation>{name} : {line}</translation>
    </message>
    <message>
        <source>The extension cannot be loaded ({reason}): update it.</source>
        <translation>L&apos;extension ne peut pas être chargée ({reason}) : mettez-la à jour.</translation>
    </message>
</context>
<context>
    <name>panel.stage_words</name>
    <message>
        <source>Saving the result...</source>
        <translation>Enregistrement du résultat...</translation>
    </message>
    <message>
        <source>Saving the track...</source>
        <translation>Enregistrement du suivi...</translation>
    </message>
    <message>
        <source>Tracking: {frame} of {of} frames</source>
        <translation>Suivi : {frame} instants sur {of}</translation>
    </message>
    <message>
        <source>Back: {frame} of {of} frames</source>
        <translation>Retour : {frame} instants sur {of}</translation>
    </message>
    <message>
        <source>Preparing the CT</source>
        <translation>Préparation du scanner</translation>
    </message>
    <message>
        <source>Fitting the bones</source>
        <translation>Ajustement des os</translation>
    </message>
    <message>
        <source>Looking for better places of bones</source>
        <translation>Recherche de meilleures positions des os</translation>
    </message>
    <message>
        <source>Looking at united bones one by one</source>
        <translation>Examen un par un des os réunis</translation>
    </message>
    <message>
        <source>Estimating the uncertainty</source>
        <translation>Estimation de l&apos;incertitude</translation>
    </message>
    <message>
        <source>Warping the CT</source>
        <translation>Déformation du scanner</translation>
    </message>
    <message>
        <source>Rendering the X-rays</source>
        <translation>Rendu des radiographies</translation>
    </message>
    <message>
        <source>{stage}: {iteration} of {of}</source>
        <translation>{stage}&#xa0;: {iteration} sur {of}</translation>
    </message>
    <message>
        <source>about {minutes:.0f} min left in this pass</source>
        <translation>encore environ {minutes:.0f} min dans ce passage</translation>
    </message>
    <message>
        <source>, similarity {similarity:.4f}</source>
        <translation>, similarité {similarity:.4f}</translation>
    </message>
    <message>
        <source>about {seconds:.0f} s left in this pass</source>
        <translation>encore environ {seconds:.0f} s dans ce passage</translation>
    </message>
    <message>
        <source>Camera of {name}</source>
        <translation>Caméra de {name}</translation>
    </message>
</context>
<context>
    <name>panel.structures</name>
    <message>
        <source>No segment has the name of a bone, such as femur_left or &apos;Left femur&apos;: rename the segments, or type the structures into the table.</source>
        <translation>Aucun segment ne porte le nom d&apos;un os, comme femur_left ou &apos;Left femur&apos;&#xa0;: renommez les segments, ou saisissez les structures dans le tableau.</translation>
    </message>
    <message>
        <source>Choose a CT and its segmentation; every bone needs a segment.</source>
        <translation>Choisissez un scanner et sa segmentation&#xa0;; chaque os a besoin d&apos;un segment.</translation>
    </message>
    <message>
        <source>No segment is included yet: propose structures, or check segments in the table.</source>
        <translation>Aucun segment n&apos;est encore inclus&#xa0;: faites proposer les structures, ou cochez des segments dans le tableau.</translation>
    </message>
    <message>
        <source>Segment (moves)</source>
        <translation>Segment (mobile)</translation>
    </message>
    <message>
        <source>Structure</source>
        <translation>Structure</translation>
    </message>
    <message>
        <source>Anchor</source>
        <translation>Ancre</translation>
    </message>
    <message>
        <source>Checked: this segment moves as a bone.</source>
        <translation>Coché&#xa0;: ce segment se déplace comme un os.</translation>
    </message>
    <message>
        <source>Moving relative to the anchor, &apos;{anchor}&apos;: {names}.</source>
        <translation>Mobiles par rapport à l&apos;ancre, «&#xa0;{anchor}&#xa0;»&#xa0;: {names}.</translation>
    </message>
    <message>
        <source>anchor</source>
        <translation>ancre</translation>
    </message>
    <message>
        <source>{count} structures; now check the anchor, which stays where it is.</source>
        <translation>{count} structures&#xa0;; vérifiez maintenant l&apos;ancre, qui reste en place.</translation>
    </message>
    <message>
        <source>Only the anchor, &apos;{anchor}&apos;, is included: the cameras will be found, and no bone moves.</source>
        <translation>Seule l&apos;ancre, «&#xa0;{anchor}&#xa0;», est incluse&#xa0;: les caméras seront trouvées, et aucun os ne bougera.</translation>
    </message>
</context>
<context>
    <name>panel.track_review</name>
    <message>
        <source>forward and backward</source>
        <translation>en avant et en arrière</translation>
    </message>
    <message>
        <source>forward</source>
        <translation>en avant</translation>
    </message>
    <message>
        <source>backward</source>
        <translation>en arrière</translation>
    </message>
    <message>
        <source>Saving the track...</source>
        <translation>Enregistrement du suivi...</translation>
    </message>
    <message>
        <source>Save the track into a folder</source>
        <translation>Enregistrer le suivi dans un dossier</translation>
    </message>
    <message>
        <source>A smoothed track cannot be continued: track without smoothing first.</source>
        <translation>Un suivi lissé ne peut pas être continué : suivre d&apos;abord sans lissage.</translation>
    </message>
    <message>
        <source>{count} doubtful frames in this direction.</source>
        <translation>{count} instants douteux dans cette direction.</translation>
    </message>
    <message>
        <source>The scene has the poses alone: tables and plots of joints are left out.</source>
        <translation>La scène ne contient que les poses : les tableaux et courbes des articulations manquent.</translation>
    </message>
    <message>
        <source>Corrections are not in it before you track on from them.</source>
        <translation>Les corrections n&apos;y sont qu&apos;après un nouveau suivi à partir d&apos;elles.</translation>
    </message>
    <message>
        <source>Track anew from the bones of this frame, as you have corrected them; other frames are kept.</source>
        <translation>Suivre à nouveau à partir des os de cet instant, tels que vous les avez corrigés ; les autres instants sont conservés.</translation>
    </message>
    <message>
        <source>The track could not be written: {reason}</source>
        <translation>Le suivi n&apos;a pas pu être écrit : {reason}</translation>
    </message>
    <message>
        <source>Written to {folder}.</source>
        <translation>Écrit dans {folder}.</translation>
    </message>
</context>
<context>
    <name>panel.track_words</name>
    <message>
        <source>Look at the outlines on the X-rays all the same.</source>
        <translation>Regarder tout de même les contours sur les radiographies.</translation>
    </message>
    <message>
        <source>What to do: correct a doubtful frame and track on from there, or give better cameras.</source>
        <translation>Que faire : corriger un instant douteux et suivre à partir de là, ou donner de meilleures caméras.</translation>
    </message>
    <message>
        <source>The checks found no sign of failure</source>
        <translation>Les contrôles n&apos;ont trouvé aucun signe d&apos;échec</translation>
    </message>
    <message>
        <source>{frames} frames are tracked, in {seconds:.0f} s.</source>
        <translation>{frames} instants sont suivis, en {seconds:.0f} s.</translation>
    </message>
    <message>
        <source>DO NOT TRUST THIS TRACK</source>
        <translation>NE PAS SE FIER À CE SUIVI</translation>
    </message>
    <message>
        <source>Check the doubtful frames before you use the track</source>
        <translation>Vérifier les instants douteux avant d&apos;utiliser le suivi</translation>
    </message>
    <message>
        <source>{name}: {count} images; frame 0 is image {first}.</source>
        <translation>{name} : {count} images ; à l&apos;instant 0 correspond l&apos;image {first}.</translation>
    </message>
    <message>
        <source>{name}: {doubtful} doubtful frames, lost in {lost} of them.</source>
        <translation>{name} : {doubtful} instants douteux, dont {lost} où il est perdu.</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>Avertissement&#xa0;: {text}</translation>
    </message>
    <message>
        <source>Frame {number}</source>
        <translation>Instant {number}</translation>
    </message>
    <message>
        <source>Why: {why}</source>
        <translation>Raison&#xa0;: {why}</translation>
    </message>
    <message>
        <source>Corrected by hand: {names}.</source>
        <translation>Corrigé à la main : {names}.</translation>
    </message>
    <message>
        <source>{name} was lost.</source>
        <translation>{name} a été perdu.</translation>
    </message>
    <message>
        <source>{name} is doubtful: {why}.</source>
        <translation>{name} est douteux : {why}.</translation>
    </message>
</context>
<context>
    <name>panel.tracking</name>
    <message>
        <source>Preparing the data...</source>
        <translation>Préparation des données...</translation>
    </message>
    <message>
        <source>Track</source>
        <translation>Suivre</translation>
    </message>
    <message>
        <source>Reading the track...</source>
        <translation>Lecture du suivi...</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Annulation...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Annuler</translation>
    </message>
    <message>
        <source>Stop the tracking; frames that are done are kept.</source>
        <translation>Arrêter le suivi ; les instants terminés sont conservés.</translation>
    </message>
    <message>
        <source>Follow the bones through the sequences.</source>
        <translation>Suivre les os à travers les séquences.</translation>
    </message>
    <message>
        <source>{count} frames of an interrupted tracking are kept: Go on continues after them.

Begin anew all the same? They are removed once the new tracking has frames of its own.</source>
        <translation>{count} instants d&apos;un suivi interrompu sont conservés : Reprendre continue après eux.

Recommencer quand même ? Ils seront supprimés dès que le nouveau suivi aura ses propres instants.</translation>
    </message>
    <message>
        <source>Cancelled.</source>
        <translation>Annulé.</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Annulé&#xa0;; rien n&apos;a été modifié.</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>Démarrage...</translation>
    </message>
    <message>
        <source>The finished track is in {folder} until the scene is closed.</source>
        <translation>Le suivi terminé se trouve dans {folder} jusqu&apos;à la fermeture de la scène.</translation>
    </message>
    <message>
        <source>{count} frames are kept: press Go on to continue after them, as long as the inputs stay as they are.</source>
        <translation>{count} instants sont conservés : Reprendre continue après eux, tant que les entrées restent les mêmes.</translation>
    </message>
    <message>
        <source>Ready: {bones} structures, {cameras} cameras, frames {first} to {last}, {rate:.4g} a second.</source>
        <translation>Prêt : {bones} structures, {cameras} caméras, instants {first} à {last}, {rate:.4g} par seconde.</translation>
    </message>
</context>
<context>
    <name>panel.undo</name>
    <message>
        <source>Redo</source>
        <translation>Rétablir</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Défaire</translation>
    </message>
    <message>
        <source>Brings back what was there before the last registration.</source>
        <translation>Ramène ce qui était là avant le dernier recalage.</translation>
    </message>
    <message>
        <source>Bring back the result of the last registration.</source>
        <translation>Ramener le résultat du dernier recalage.</translation>
    </message>
    <message>
        <source>Take the result of the last registration out of the scene; Redo brings it back.</source>
        <translation>Retirer de la scène le résultat du dernier recalage&#xa0;; «&#xa0;Rétablir&#xa0;» le ramène.</translation>
    </message>
    <message>
        <source>Bring back the result that was there before the last registration.</source>
        <translation>Ramener le résultat qui était là avant le dernier recalage.</translation>
    </message>
</context>
<context>
    <name>panel.verdict</name>
    <message>
        <source>Look at the overlay of each X-ray all the same.</source>
        <translation>Regardez tout de même la superposition de chaque radiographie.</translation>
    </message>
    <message>
        <source>What to do: look at the overlay of each X-ray; where it does not match, give a better initial camera or landmarks, and register again.</source>
        <translation>Que faire&#xa0;: regardez la superposition de chaque radiographie&#xa0;; là où elle ne concorde pas, donnez une meilleure caméra initiale ou des repères, et recalez de nouveau.</translation>
    </message>
    <message>
        <source>The checks found no sign of failure</source>
        <translation>Les contrôles n&apos;ont trouvé aucun signe d&apos;échec</translation>
    </message>
    <message>
        <source>DO NOT TRUST THIS RESULT</source>
        <translation>NE VOUS FIEZ PAS À CE RÉSULTAT</translation>
    </message>
    <message>
        <source>Check what is named here before you use the result</source>
        <translation>Vérifiez ce qui est indiqué ici avant d&apos;utiliser le résultat</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>Avertissement&#xa0;: {text}</translation>
    </message>
    <message>
        <source>Why: {why}</source>
        <translation>Raison&#xa0;: {why}</translation>
    </message>
</context>
<context>
    <name>panel.xray_details</name>
    <message>
        <source>as in the file</source>
        <translation>comme dans le fichier</translation>
    </message>
    <message>
        <source>&apos;{text}&apos; is not a number: use digits and a decimal point, or leave the field empty.</source>
        <translation>«&#xa0;{text}&#xa0;» n&apos;est pas un nombre&#xa0;: utilisez des chiffres et un point décimal, ou laissez le champ vide.</translation>
    </message>
</context>
<context>
    <name>panel.xray_drop</name>
    <message>
        <source>drop image files, or loaded X-rays (a volume, a sequence, or a folder of them) from a tree of the data</source>
        <translation>déposez des fichiers d&apos;image, ou des radiographies chargées (un volume, une séquence ou un dossier) depuis une arborescence de données</translation>
    </message>
    <message>
        <source>No X-ray: {names}; {can}.</source>
        <translation>Pas une radiographie : {names} ; {can}.</translation>
    </message>
    <message>
        <source>Nothing here is an X-ray: {can}.</source>
        <translation>Rien ici n&apos;est une radiographie : {can}.</translation>
    </message>
    <message>
        <source>{names} and {count} more</source>
        <translation>{names} et {count} autres</translation>
    </message>
</context>
<context>
    <name>panel.xrays</name>
    <message>
        <source>Add two or more X-rays from different directions.</source>
        <translation>Ajoutez deux radiographies ou plus, de directions différentes.</translation>
    </message>
    <message>
        <source>X-ray</source>
        <translation>Radiographie</translation>
    </message>
    <message>
        <source>Geometry from</source>
        <translation>Géométrie d&apos;après</translation>
    </message>
    <message>
        <source>Camera</source>
        <translation>Caméra</translation>
    </message>
    <message>
        <source>State</source>
        <translation>État</translation>
    </message>
    <message>
        <source>X-rays</source>
        <translation>Radiographies</translation>
    </message>
    <message>
        <source>All files</source>
        <translation>Tous les fichiers</translation>
    </message>
    <message>
        <source>Read geometry</source>
        <translation>Lire la géométrie</translation>
    </message>
    <message>
        <source>Study files (*.json)</source>
        <translation>Fichiers d&apos;étude (*.json)</translation>
    </message>
    <message>
        <source>What was dropped is in the table already.</source>
        <translation>Ce qui a été déposé est déjà dans le tableau.</translation>
    </message>
    <message>
        <source>Add X-rays</source>
        <translation>Ajouter des radiographies</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is not ready: complete its geometry, or remove it.</source>
        <translation>La radiographie «&#xa0;{name}&#xa0;» n&apos;est pas prête&#xa0;: complétez sa géométrie, ou retirez-la.</translation>
    </message>
</context>
<context>
    <name>process.camera_run</name>
    <message>
        <source>search</source>
        <translation>recherche</translation>
    </message>
    <message>
        <source>The result of the search cannot be read: search again.</source>
        <translation>Le résultat de la recherche est illisible&#xa0;: cherchez de nouveau.</translation>
    </message>
</context>
<context>
    <name>process.dependencies</name>
    <message>
        <source>PyTorch is missing, and nothing is installed while testing.</source>
        <translation>PyTorch manque, et rien n&apos;est installé pendant les tests.</translation>
    </message>
    <message>
        <source>PyTorch was not installed: PolyPose cannot register without it.</source>
        <translation>PyTorch n&apos;a pas été installé&#xa0;: sans lui, PolyPose ne peut pas recaler.</translation>
    </message>
    <message>
        <source>PyTorch is missing: install the extension PyTorch in the Extensions Manager and restart Slicer.</source>
        <translation>PyTorch manque&#xa0;: installez l&apos;extension PyTorch dans le gestionnaire d&apos;extensions et redémarrez Slicer.</translation>
    </message>
    <message>
        <source>The Python packages that PolyPose needs were not installed ({reason}): try again.</source>
        <translation>Les paquets Python dont PolyPose a besoin n&apos;ont pas été installés ({reason})&#xa0;: réessayez.</translation>
    </message>
    <message>
        <source>PyTorch could not be installed ({reason}): install it in the module PyTorch Utils.</source>
        <translation>PyTorch n&apos;a pas pu être installé ({reason})&#xa0;: installez-le dans le module PyTorch Utils.</translation>
    </message>
</context>
<context>
    <name>process.dicom_export</name>
    <message>
        <source>DICOM export</source>
        <translation>exportation DICOM</translation>
    </message>
</context>
<context>
    <name>process.environment</name>
    <message>
        <source>PolyPose needs 3D Slicer {needed} or newer, and this is {found}: install the current stable version.</source>
        <translation>PolyPose a besoin de 3D Slicer {needed} ou plus récent, et ceci est {found}&#xa0;: installez la version stable actuelle.</translation>
    </message>
</context>
<context>
    <name>process.extensions</name>
    <message>
        <source>Bones are segmented by the extension TotalSegmentator or MONAIAuto3DSeg: install one in the Extensions Manager and restart Slicer.</source>
        <translation>Les os sont segmentés par l&apos;extension TotalSegmentator ou MONAIAuto3DSeg : installez-en une dans l&apos;Extensions Manager et redémarrez Slicer.</translation>
    </message>
    <message>
        <source>Bones are segmented by an extension, and neither TotalSegmentator nor MONAIAuto3DSeg is installed.

Install {name} now, with the extensions that it needs? It is downloaded from Slicer&apos;s extensions server.</source>
        <translation>Les os sont segmentés par une extension, et ni TotalSegmentator ni MONAIAuto3DSeg n&apos;est installée.

Installer {name} maintenant, avec les extensions dont il a besoin ? Il est téléchargé depuis le serveur d&apos;extensions de Slicer.</translation>
    </message>
    <message>
        <source>{name} was installed: save your data and restart Slicer.</source>
        <translation>{name} a été installé : enregistrez vos données et redémarrez Slicer.</translation>
    </message>
    <message>
        <source>The extension {name} is installed, but its module is not loaded: restart Slicer, or enable it in the Extensions Manager.</source>
        <translation>L&apos;extension {name} est installée, mais son module n&apos;est pas chargé : redémarrez Slicer ou activez-la dans l&apos;Extensions Manager.</translation>
    </message>
    <message>
        <source>The extension {name} could not be installed: check the network connection, or install it in the Extensions Manager.</source>
        <translation>L&apos;extension {name} n&apos;a pas pu être installée : vérifiez la connexion au réseau ou installez-la dans l&apos;Extensions Manager.</translation>
    </message>
    <message>
        <source>{name} was installed. Slicer must be restarted before it can be used; data that were not saved are lost. Restart now?</source>
        <translation>{name} a été installé. Slicer doit être redémarré avant de l&apos;utiliser ; les données non enregistrées sont perdues. Redémarrer maintenant ?</translation>
    </message>
</context>
<context>
    <name>process.monai_auto3dseg</name>
    <message>
        <source>MONAIAuto3DSeg offers no model of bones: update the extension.</source>
        <translation>MONAIAuto3DSeg n&apos;offre aucun modèle d&apos;os : mettez l&apos;extension à jour.</translation>
    </message>
    <message>
        <source>computing</source>
        <translation>calcul</translation>
    </message>
    <message>
        <source>MONAIAuto3DSeg ended with the code {code}: see the application&apos;s log.</source>
        <translation>MONAIAuto3DSeg s&apos;est terminé avec le code {code} : voir le journal de l&apos;application.</translation>
    </message>
    <message>
        <source>MONAIAuto3DSeg&apos;s result could not be read: see the application&apos;s log.</source>
        <translation>Le résultat de MONAIAuto3DSeg n&apos;a pas pu être lu : voir le journal de l&apos;application.</translation>
    </message>
    <message>
        <source>reading the result</source>
        <translation>lecture du résultat</translation>
    </message>
</context>
<context>
    <name>process.registration</name>
    <message>
        <source>registration</source>
        <translation>recalage</translation>
    </message>
    <message>
        <source>The result must not be trusted: {reasons}.</source>
        <translation>Le résultat n&apos;est pas fiable&#xa0;: {reasons}.</translation>
    </message>
    <message>
        <source>{name} transform</source>
        <translation>{name}&#xa0;: transformation</translation>
    </message>
</context>
<context>
    <name>process.render_client</name>
    <message>
        <source>The CT cannot be rendered ({reason}): choose the CT again to retry.</source>
        <translation>Le rendu du scanner est impossible ({reason})&#xa0;: choisissez de nouveau le scanner pour réessayer.</translation>
    </message>
    <message>
        <source>its process ended</source>
        <translation>son processus s&apos;est arrêté</translation>
    </message>
    <message>
        <source>The rendering cannot be read: {reason}.</source>
        <translation>Le rendu est illisible&#xa0;: {reason}.</translation>
    </message>
</context>
<context>
    <name>process.segmentation_task</name>
    <message>
        <source>The segmentation was cancelled; nothing was changed.</source>
        <translation>La segmentation a été annulée ; rien n&apos;a été modifié.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; was deleted while the CT was segmented: start the segmentation again.</source>
        <translation>« {name} » a été supprimé pendant la segmentation du scanner : relancez la segmentation.</translation>
    </message>
</context>
<context>
    <name>process.study_run</name>
    <message>
        <source>registration</source>
        <translation>recalage</translation>
    </message>
    <message>
        <source>a crash</source>
        <translation>un plantage</translation>
    </message>
    <message>
        <source>Memory ran out: crop the CT or use a coarser one.</source>
        <translation>Mémoire insuffisante&#xa0;: recadrez le scanner ou utilisez-en un plus grossier.</translation>
    </message>
    <message>
        <source>The {what} ended without a result (exit status {status}).</source>
        <translation>Opération «&#xa0;{what}&#xa0;» terminée sans résultat (code de sortie {status}).</translation>
    </message>
    <message>
        <source>signal {number}</source>
        <translation>signal {number}</translation>
    </message>
    <message>
        <source>The {what} was cancelled.</source>
        <translation>Opération «&#xa0;{what}&#xa0;» annulée.</translation>
    </message>
    <message>
        <source>The {what} was interrupted from outside.</source>
        <translation>Opération «&#xa0;{what}&#xa0;» interrompue de l&apos;extérieur.</translation>
    </message>
    <message>
        <source>The {what}&apos;s process was ended by the system ({end}), most often because memory ran out: use the fast preset, or crop the CT.</source>
        <translation>Le processus de l&apos;opération «&#xa0;{what}&#xa0;» a été arrêté par le système ({end}), le plus souvent faute de mémoire&#xa0;: utilisez le préréglage rapide, ou recadrez le scanner.</translation>
    </message>
    <message>
        <source>The Python package &apos;{name}&apos; is missing: let PolyPose install what it needs.</source>
        <translation>Le paquet Python «&#xa0;{name}&#xa0;» manque&#xa0;: laissez PolyPose installer ce dont il a besoin.</translation>
    </message>
    <message>
        <source>The {what} rejected its input without giving a reason.</source>
        <translation>L&apos;opération «&#xa0;{what}&#xa0;» a rejeté ses données d&apos;entrée sans donner de raison.</translation>
    </message>
    <message>
        <source>{program} could not be started ({reason}): install Slicer again.</source>
        <translation>{program} n&apos;a pas pu démarrer ({reason})&#xa0;: réinstallez Slicer.</translation>
    </message>
    <message>
        <source>An unexpected error occurred: {fault}.</source>
        <translation>Une erreur inattendue s&apos;est produite&#xa0;: {fault}.</translation>
    </message>
</context>
<context>
    <name>process.track_run</name>
    <message>
        <source>tracking</source>
        <translation>suivi</translation>
    </message>
    <message>
        <source>The track must not be trusted: {reasons}.</source>
        <translation>Le suivi n&apos;est pas fiable : {reasons}.</translation>
    </message>
</context>
<context>
    <name>scene.bone_handles</name>
    <message>
        <source>Adjustment of {name}</source>
        <translation>Ajustement de {name}</translation>
    </message>
    <message>
        <source>{name}, adjusted</source>
        <translation>{name}, ajusté</translation>
    </message>
    <message>
        <source>Outline of {name}</source>
        <translation>Contour de {name}</translation>
    </message>
</context>
<context>
    <name>scene.bone_models</name>
    <message>
        <source>Motion of {name}</source>
        <translation>Mouvement de {name}</translation>
    </message>
    <message>
        <source>{name} in 3D</source>
        <translation>{name} en 3D</translation>
    </message>
</context>
<context>
    <name>scene.cameras</name>
    <message>
        <source>The camera &apos;{name}&apos; is not a linear transform: choose one that is.</source>
        <translation>La caméra «&#xa0;{name}&#xa0;» n&apos;est pas une transformation linéaire&#xa0;: choisissez-en une qui le soit.</translation>
    </message>
</context>
<context>
    <name>scene.carried_nodes</name>
    <message>
        <source>{name} carried along</source>
        <translation>{name} emporté</translation>
    </message>
</context>
<context>
    <name>scene.carried_points</name>
    <message>
        <source>{name} as X-rayed</source>
        <translation>{name} comme sur les radiographies</translation>
    </message>
</context>
<context>
    <name>scene.deformation</name>
    <message>
        <source>PolyPose volume change</source>
        <translation>PolyPose variation de volume</translation>
    </message>
    <message>
        <source>PolyPose volume change colours</source>
        <translation>PolyPose couleurs de la variation de volume</translation>
    </message>
    <message>
        <source>PolyPose weight</source>
        <translation>PolyPose poids</translation>
    </message>
    <message>
        <source>PolyPose weight colours</source>
        <translation>PolyPose couleurs du poids</translation>
    </message>
    <message>
        <source>Volume changes by a factor of {low:.2f} to {high:.2f} (99 % of the grid).</source>
        <translation>Le volume varie d&apos;un facteur de {low:.2f} à {high:.2f} (99&#xa0;% de la grille).</translation>
    </message>
    <message>
        <source>The deformation folds in {share:.2f} % of the grid (magenta): do not trust the soft tissue there.</source>
        <translation>La déformation se replie dans {share:.2f}&#xa0;% de la grille (magenta)&#xa0;: ne vous y fiez pas aux tissus mous.</translation>
    </message>
    <message>
        <source>PolyPose weight of {name}</source>
        <translation>PolyPose poids de {name}</translation>
    </message>
    <message>
        <source>No folds.</source>
        <translation>Aucun repli.</translation>
    </message>
    <message>
        <source>There is no structure &apos;{name}&apos;: choose one from the table.</source>
        <translation>Il n&apos;y a pas de structure «&#xa0;{name}&#xa0;»&#xa0;: choisissez-en une dans le tableau.</translation>
    </message>
</context>
<context>
    <name>scene.ellipsoids</name>
    <message>
        <source>95 % ellipsoids of carried points</source>
        <translation>Ellipsoïdes à 95 % des points emportés</translation>
    </message>
</context>
<context>
    <name>scene.grid_transform</name>
    <message>
        <source>&apos;{node}&apos; does not hold a displacement grid: register first, or load a result.</source>
        <translation>«&#xa0;{node}&#xa0;» ne contient pas de grille de déplacement&#xa0;: lancez d&apos;abord un recalage, ou chargez un résultat.</translation>
    </message>
</context>
<context>
    <name>scene.motions</name>
    <message>
        <source>Structure</source>
        <translation>Structure</translation>
    </message>
    <message>
        <source>Rotation [deg]</source>
        <translation>Rotation [deg]</translation>
    </message>
    <message>
        <source>Displacement [mm]</source>
        <translation>Déplacement [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % along the beam [mm]</source>
        <translation>{percent:.0f}&#xa0;% le long du faisceau [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % across the beam [mm]</source>
        <translation>{percent:.0f}&#xa0;% en travers du faisceau [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % about the beam [deg]</source>
        <translation>{percent:.0f}&#xa0;% autour du faisceau [deg]</translation>
    </message>
    <message>
        <source>{percent:.0f} % across the beam [deg]</source>
        <translation>{percent:.0f}&#xa0;% en travers du faisceau [deg]</translation>
    </message>
    <message>
        <source>Right [mm]</source>
        <translation>Droite [mm]</translation>
    </message>
    <message>
        <source>Anterior [mm]</source>
        <translation>Antérieur [mm]</translation>
    </message>
    <message>
        <source>Superior [mm]</source>
        <translation>Supérieur [mm]</translation>
    </message>
    <message>
        <source>Axis R</source>
        <translation>Axe R</translation>
    </message>
    <message>
        <source>Axis A</source>
        <translation>Axe A</translation>
    </message>
    <message>
        <source>Axis S</source>
        <translation>Axe S</translation>
    </message>
    <message>
        <source>Doubts</source>
        <translation>Doutes</translation>
    </message>
</context>
<context>
    <name>scene.nodes</name>
    <message>
        <source>The volume &apos;{name}&apos; has no voxels: load it again.</source>
        <translation>Le volume «&#xa0;{name}&#xa0;» n&apos;a pas de voxels&#xa0;: chargez-le de nouveau.</translation>
    </message>
    <message>
        <source>The segmentation &apos;{name}&apos; has no segment &apos;{segment}&apos;.</source>
        <translation>La segmentation «&#xa0;{name}&#xa0;» n&apos;a pas de segment «&#xa0;{segment}&#xa0;».</translation>
    </message>
    <message>
        <source>The segmentation &apos;{name}&apos; cannot be converted to label maps.</source>
        <translation>La segmentation «&#xa0;{name}&#xa0;» ne peut pas être convertie en cartes d&apos;étiquettes.</translation>
    </message>
</context>
<context>
    <name>scene.track_charts</name>
    <message>
        <source>angle [deg]</source>
        <translation>angle [deg]</translation>
    </message>
    <message>
        <source>translation [mm]</source>
        <translation>translation [mm]</translation>
    </message>
    <message>
        <source>time [s]</source>
        <translation>temps [s]</translation>
    </message>
    <message>
        <source>{joint} angles</source>
        <translation>{joint} : angles</translation>
    </message>
    <message>
        <source>{joint} angles, doubtful</source>
        <translation>{joint} : angles, douteux</translation>
    </message>
    <message>
        <source>{joint} angles, this frame</source>
        <translation>{joint} : angles, cette image</translation>
    </message>
    <message>
        <source>{joint} translations</source>
        <translation>{joint} : translations</translation>
    </message>
    <message>
        <source>{joint} translations, doubtful</source>
        <translation>{joint} : translations, douteuses</translation>
    </message>
    <message>
        <source>{joint} translations, this frame</source>
        <translation>{joint} : translations, cette image</translation>
    </message>
    <message>
        <source>{title}, values</source>
        <translation>{title}, valeurs</translation>
    </message>
    <message>
        <source>{title}, intervals</source>
        <translation>{title}, intervalles</translation>
    </message>
    <message>
        <source>{quantity}, 95 %</source>
        <translation>{quantity}, 95 %</translation>
    </message>
    <message>
        <source>{title}, cursor</source>
        <translation>{title}, curseur</translation>
    </message>
    <message>
        <source>{title}, doubtful frames</source>
        <translation>{title}, images douteuses</translation>
    </message>
</context>
<context>
    <name>scene.track_outlines</name>
    <message>
        <source>Outline of {bone} on {xray}</source>
        <translation>Contour de {bone} sur {xray}</translation>
    </message>
</context>
<context>
    <name>scene.track_sequences</name>
    <message>
        <source>&apos;{name}&apos; holds no images: choose a sequence of X-rays, or a volume.</source>
        <translation>« {name} » ne contient pas d&apos;images : choisissez une séquence de radiographies ou un volume.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is not an image: choose a volume or a sequence of volumes.</source>
        <translation>«&#xa0;{name}&#xa0;» n&apos;est pas une image&#xa0;: choisissez un volume ou une séquence de volumes.</translation>
    </message>
</context>
<context>
    <name>scene.xray_views</name>
    <message>
        <source>View of {name}</source>
        <translation>Vue de {name}</translation>
    </message>
    <message>
        <source>C-arm of {name}</source>
        <translation>Arceau de {name}</translation>
    </message>
    <message>
        <source>Detector of {name}</source>
        <translation>Détecteur de {name}</translation>
    </message>
</context>
<context>
    <name>study.camera_source</name>
    <message>
        <source>automatic: the best available</source>
        <translation>automatique&#xa0;: la meilleure disponible</translation>
    </message>
    <message>
        <source>C-arm placed by hand</source>
        <translation>arceau placé à la main</translation>
    </message>
    <message>
        <source>DICOM angles</source>
        <translation>angles DICOM</translation>
    </message>
    <message>
        <source>landmarks</source>
        <translation>repères</translation>
    </message>
    <message>
        <source>search</source>
        <translation>recherche</translation>
    </message>
    <message>
        <source>model trained on this CT</source>
        <translation>modèle entraîné sur ce scanner</translation>
    </message>
    <message>
        <source>calibrated camera</source>
        <translation>caméra étalonnée</translation>
    </message>
</context>
<context>
    <name>study.carried_points</name>
    <message>
        <source>Points moved by the bone in which they lie: {count}.</source>
        <translation>Points déplacés par l&apos;os qui les contient&#xa0;: {count}.</translation>
    </message>
    <message>
        <source>Points moved by the displacement field: {count}.</source>
        <translation>Points déplacés par le champ de déplacement&#xa0;: {count}.</translation>
    </message>
    <message>
        <source>Points outside of the result&apos;s grid, which are only roughly right: {count}.</source>
        <translation>Points hors de la grille du résultat, seulement approximatifs&#xa0;: {count}.</translation>
    </message>
    <message>
        <source>The longest half axes of the 95 % ellipsoids: {least:.1f} to {most:.1f} mm.</source>
        <translation>Plus longs demi-axes des ellipsoïdes à 95 %&#xa0;: de {least:.1f} à {most:.1f} mm.</translation>
    </message>
    <message>
        <source>Points whose uncertainty is not known: {count}.</source>
        <translation>Points dont l&apos;incertitude n&apos;est pas connue&#xa0;: {count}.</translation>
    </message>
</context>
<context>
    <name>study.field_words</name>
    <message>
        <source>set &quot;{field}&quot; to &quot;{choice}&quot;</source>
        <translation>réglez «&#xa0;{field}&#xa0;» sur «&#xa0;{choice}&#xa0;»</translation>
    </message>
    <message>
        <source>Source to detector</source>
        <translation>Source-détecteur</translation>
    </message>
    <message>
        <source>Source to isocentre</source>
        <translation>Source-isocentre</translation>
    </message>
    <message>
        <source>Pixel spacing</source>
        <translation>Taille des pixels</translation>
    </message>
    <message>
        <source>Principal point</source>
        <translation>Point principal</translation>
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
        <translation>Isocentre</translation>
    </message>
    <message>
        <source>Patient position</source>
        <translation>Position du patient</translation>
    </message>
    <message>
        <source>Search near</source>
        <translation>Chercher près de</translation>
    </message>
    <message>
        <source>Camera pose</source>
        <translation>Pose de la caméra</translation>
    </message>
    <message>
        <source>Image seen from</source>
        <translation>Image vue depuis</translation>
    </message>
    <message>
        <source>the source</source>
        <translation>la source</translation>
    </message>
    <message>
        <source>Distortion</source>
        <translation>Distorsion</translation>
    </message>
    <message>
        <source>corrected</source>
        <translation>corrigée</translation>
    </message>
</context>
<context>
    <name>study.landmark_fit</name>
    <message>
        <source>The landmarks</source>
        <translation>Les repères</translation>
    </message>
    <message>
        <source>Only in the CT: {names}.</source>
        <translation>Seulement dans le scanner&#xa0;: {names}.</translation>
    </message>
    <message>
        <source>Only in the X-ray: {names}.</source>
        <translation>Seulement dans la radiographie&#xa0;: {names}.</translation>
    </message>
    <message>
        <source>Not on the X-ray: {names}; pick them in the X-ray&apos;s own view.</source>
        <translation>Hors de la radiographie&#xa0;: {names}&#xa0;; placez-les dans la vue propre à la radiographie.</translation>
    </message>
    <message>
        <source>{used} of {count} landmarks used, RMS error {rms:.1f} mm; expected accuracy of the camera: {degrees:.1f} deg and {mm:.0f} mm.</source>
        <translation>{used} repères utilisés sur {count}, erreur RMS {rms:.1f} mm&#xa0;; précision attendue de la caméra&#xa0;: {degrees:.1f}° et {mm:.0f} mm.</translation>
    </message>
    <message>
        <source>Uncertain: {why}.</source>
        <translation>Incertaine&#xa0;: {why}.</translation>
    </message>
    <message>
        <source>{count} of at least {fewest} pairs: pick {missing} more, on the anchor.</source>
        <translation>{count} paires sur au moins {fewest}&#xa0;: placez-en encore {missing}, sur l&apos;ancre.</translation>
    </message>
</context>
<context>
    <name>study.parameters</name>
    <message>
        <source>Choose the CT.</source>
        <translation>Choisissez le scanner.</translation>
    </message>
    <message>
        <source>Choose the segmentation of the CT&apos;s bones.</source>
        <translation>Choisissez la segmentation des os du scanner.</translation>
    </message>
    <message>
        <source>Assign at least one segment to a structure, or have the structures proposed.</source>
        <translation>Attribuez au moins un segment à une structure, ou faites proposer les structures.</translation>
    </message>
    <message>
        <source>Choose the anchor: the structure that stays where it is.</source>
        <translation>Choisissez l&apos;ancre&#xa0;: la structure qui reste en place.</translation>
    </message>
    <message>
        <source>Add an X-ray; two or more from different directions are better.</source>
        <translation>Ajoutez une radiographie&#xa0;; deux ou plus, de directions différentes, valent mieux.</translation>
    </message>
    <message>
        <source>Default</source>
        <translation>Par défaut</translation>
    </message>
    <message>
        <source>Fast (for a first look)</source>
        <translation>Rapide (pour un premier aperçu)</translation>
    </message>
    <message>
        <source>Paper (the published settings)</source>
        <translation>Article (les réglages publiés)</translation>
    </message>
    <message>
        <source>Automatic</source>
        <translation>Automatique</translation>
    </message>
    <message>
        <source>Processor (CPU)</source>
        <translation>Processeur (CPU)</translation>
    </message>
    <message>
        <source>Graphics card (GPU, CUDA)</source>
        <translation>Carte graphique (GPU, CUDA)</translation>
    </message>
    <message>
        <source>The rig &quot;{name}&quot; has only one X-ray: enter it for another X-ray as well, or clear it.</source>
        <translation>Le montage «&#xa0;{name}&#xa0;» n&apos;a qu&apos;une radiographie&#xa0;: saisissez-le aussi pour une autre, ou effacez-le.</translation>
    </message>
</context>
<context>
    <name>study.reader</name>
    <message>
        <source>{path}: there is no such file; correct the study.</source>
        <translation>{path}&#xa0;: ce fichier n&apos;existe pas&#xa0;; corrigez l&apos;étude.</translation>
    </message>
</context>
<context>
    <name>study.result_scene</name>
    <message>
        <source>{path} cannot be written: choose another folder.</source>
        <translation>Impossible d&apos;écrire {path}&#xa0;: choisissez un autre dossier.</translation>
    </message>
</context>
<context>
    <name>study.results</name>
    <message>
        <source>{name} transform</source>
        <translation>{name}&#xa0;: transformation</translation>
    </message>
    <message>
        <source>{name} warped CT</source>
        <translation>{name}&#xa0;: scanner déformé</translation>
    </message>
    <message>
        <source>{name} warped segmentation</source>
        <translation>{name}&#xa0;: segmentation déformée</translation>
    </message>
    <message>
        <source>{name} motions</source>
        <translation>{name}&#xa0;: mouvements</translation>
    </message>
    <message>
        <source>{name} similarity</source>
        <translation>{name}&#xa0;: similarité</translation>
    </message>
    <message>
        <source>{name} similarity curve</source>
        <translation>{name}&#xa0;: courbe de similarité</translation>
    </message>
    <message>
        <source>{name} similarity plot</source>
        <translation>{name}&#xa0;: graphique de similarité</translation>
    </message>
    <message>
        <source>Similarity</source>
        <translation>Similarité</translation>
    </message>
    <message>
        <source>Iteration</source>
        <translation>Itération</translation>
    </message>
    <message>
        <source>Label {number}</source>
        <translation>Étiquette {number}</translation>
    </message>
    <message>
        <source>view {number}</source>
        <translation>vue {number}</translation>
    </message>
</context>
<context>
    <name>study.scene_result</name>
    <message>
        <source>No result yet: register, or load an earlier result.</source>
        <translation>Pas encore de résultat&#xa0;: lancez un recalage, ou chargez un résultat antérieur.</translation>
    </message>
    <message>
        <source>The result has lost its table of motions: register again, or load the result again.</source>
        <translation>Le résultat a perdu son tableau des mouvements&#xa0;: relancez le recalage, ou rechargez le résultat.</translation>
    </message>
    <message>
        <source>Choose the CT of the result.</source>
        <translation>Choisissez le scanner du résultat.</translation>
    </message>
    <message>
        <source>Choose the segmentation of the result&apos;s bones: it says where they are.</source>
        <translation>Choisissez la segmentation des os du résultat&#xa0;: elle dit où ils sont.</translation>
    </message>
    <message>
        <source>The result has lost its warped CT or segmentation: register again, or load the result again.</source>
        <translation>Le résultat a perdu son scanner déformé ou sa segmentation&#xa0;: relancez le recalage, ou rechargez le résultat.</translation>
    </message>
    <message>
        <source>The result&apos;s structure &apos;{name}&apos; has no segment: assign it in the first section.</source>
        <translation>La structure «&#xa0;{name}&#xa0;» du résultat n&apos;a pas de segment&#xa0;: attribuez-le dans la première section.</translation>
    </message>
</context>
<context>
    <name>study.track_images</name>
    <message>
        <source>{camera} frames</source>
        <translation>{camera} : images</translation>
    </message>
    <message>
        <source>{camera} X-ray</source>
        <translation>{camera} : radiographie</translation>
    </message>
</context>
<context>
    <name>study.track_plan</name>
    <message>
        <source>The camera of &apos;{name}&apos; is not known: register one frame of all sequences first, whose cameras are then kept, or state that the camera is known exactly.</source>
        <translation>La caméra de &apos;{name}&apos; n&apos;est pas connue : recaler d&apos;abord un instant de toutes les séquences, dont les caméras sont alors reprises, ou indiquer que la caméra est connue exactement.</translation>
    </message>
    <message>
        <source>The images do not state how many frames there are in a second: enter it.</source>
        <translation>Les images n&apos;indiquent pas combien il y en a par seconde : saisir ce nombre.</translation>
    </message>
    <message>
        <source>No frame is left: there are {count}, counted from 0. Check the first and the last frame.</source>
        <translation>Il ne reste aucun instant : il y en a {count}, comptés à partir de 0. Vérifier le premier et le dernier.</translation>
    </message>
    <message>
        <source>Choose the bones first</source>
        <translation>Choisir d&apos;abord les os</translation>
    </message>
    <message>
        <source>Two X-rays have the name &quot;{name}&quot;: give each camera its own.</source>
        <translation>Deux radiographies portent le nom &quot;{name}&quot; : donner à chaque caméra le sien.</translation>
    </message>
    <message>
        <source>Find the cameras first</source>
        <translation>Trouver d&apos;abord les caméras</translation>
    </message>
    <message>
        <source>Enter the frame rate</source>
        <translation>Saisir la cadence</translation>
    </message>
    <message>
        <source>No frame is left that every camera has: check which image each X-ray shows (Frame).</source>
        <translation>Il ne reste aucun instant que chaque caméra possède : vérifier quelle image montre chaque radiographie (Image).</translation>
    </message>
    <message>
        <source>Check the frames</source>
        <translation>Vérifier les instants</translation>
    </message>
    <message>
        <source>Register one frame first</source>
        <translation>Recaler d&apos;abord un instant</translation>
    </message>
    <message>
        <source>There is no result to start from: register one frame, or choose another start.</source>
        <translation>Il n&apos;y a pas de résultat de départ : recaler un instant, ou choisir un autre départ.</translation>
    </message>
    <message>
        <source>Choose the CT.</source>
        <translation>Choisissez le scanner.</translation>
    </message>
    <message>
        <source>Choose the segmentation of the CT&apos;s bones.</source>
        <translation>Choisissez la segmentation des os du scanner.</translation>
    </message>
    <message>
        <source>Assign at least one segment to a structure, or have the structures proposed.</source>
        <translation>Attribuez au moins un segment à une structure, ou faites proposer les structures.</translation>
    </message>
    <message>
        <source>Choose the reference: the structure relative to which motions are reported.</source>
        <translation>Choisir la référence : la structure par rapport à laquelle les mouvements sont donnés.</translation>
    </message>
    <message>
        <source>Let a bone move</source>
        <translation>Laisser bouger un os</translation>
    </message>
    <message>
        <source>Every structure stands still: uncheck those that move in the sequence.</source>
        <translation>Toutes les structures sont immobiles : décocher celles qui bougent dans la séquence.</translation>
    </message>
    <message>
        <source>Add an X-ray sequence first</source>
        <translation>Ajouter d&apos;abord une séquence</translation>
    </message>
    <message>
        <source>None of the X-rays is a sequence: add one for each camera in the section X-rays.</source>
        <translation>Aucune des radiographies n&apos;est une séquence : en ajouter une par caméra dans la section Radiographies.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is not ready: complete its geometry, or remove it.</source>
        <translation>La radiographie «&#xa0;{name}&#xa0;» n&apos;est pas prête&#xa0;: complétez sa géométrie, ou retirez-la.</translation>
    </message>
    <message>
        <source>Name the X-rays first</source>
        <translation>Nommer d&apos;abord les radiographies</translation>
    </message>
    <message>
        <source>One camera shows next to nothing of motion along its rays: two are better.</source>
        <translation>Une seule caméra ne montre presque rien du mouvement le long de ses rayons : deux valent mieux.</translation>
    </message>
    <message>
        <source>Complete the X-rays first</source>
        <translation>Compléter les radiographies</translation>
    </message>
    <message>
        <source>The sequences state different numbers of frames per second ({rates}): enter the true one.</source>
        <translation>Les séquences indiquent des nombres différents d&apos;images par seconde ({rates}) : saisir le bon.</translation>
    </message>
    <message>
        <source>The result&apos;s poses of structures that stand still are flagged as uncertain ({names}), but the track takes them as exact and flags nothing: let them move, or correct them and register again.</source>
        <translation>Dans le résultat, les poses de structures immobiles sont signalées comme incertaines ({names}), mais le suivi les prend pour exactes et ne signale rien : laissez-les bouger, ou corrigez-les et recalez de nouveau.</translation>
    </message>
    <message>
        <source>{count} X-rays are single images and are not tracked.</source>
        <translation>{count} radiographies sont des images seules et ne sont pas suivies.</translation>
    </message>
    <message>
        <source>The sequences have different numbers of images from frame 0 on ({each}): what one of them lacks is not tracked.</source>
        <translation>Les séquences ont des nombres différents d&apos;images à partir de l&apos;instant 0 ({each}) : ce qui manque à l&apos;une n&apos;est pas suivi.</translation>
    </message>
    <message>
        <source>The images state {rate:.4g} frames per second, another number than was entered.</source>
        <translation>Les images indiquent {rate:.4g} images par seconde, un autre nombre que celui saisi.</translation>
    </message>
    <message>
        <source>{name}: by their times, images are missing after image {number}; frames are taken as evenly spaced.</source>
        <translation>{name} : d&apos;après leurs temps, des images manquent après l&apos;image {number} ; les instants sont considérés comme régulièrement espacés.</translation>
    </message>
    <message>
        <source>The result&apos;s poses belong to another frame than {frame}, which starts from them nevertheless.</source>
        <translation>Les poses du résultat ne sont pas celles de l&apos;instant {frame}, qui y commence néanmoins.</translation>
    </message>
</context>
<context>
    <name>study.track_request</name>
    <message>
        <source>where the CT has the bones</source>
        <translation>où le CT a les os</translation>
    </message>
    <message>
        <source>registration of the first frame</source>
        <translation>recalage du premier instant</translation>
    </message>
    <message>
        <source>poses of the present result</source>
        <translation>poses du résultat actuel</translation>
    </message>
</context>
<context>
    <name>study.track_scene</name>
    <message>
        <source>Track</source>
        <translation>Suivi</translation>
    </message>
    <message>
        <source>Track, all numbers</source>
        <translation>Suivi, tous les nombres</translation>
    </message>
    <message>
        <source>{bone} poses</source>
        <translation>{bone} : poses</translation>
    </message>
    <message>
        <source>The X-rays &apos;{image}&apos; have {columns} x {rows} pixels, but the track&apos;s camera &apos;{camera}&apos; has {width} x {height}: choose those that were tracked.</source>
        <translation>Les radiographies « {image} » ont {columns} x {rows} pixels, mais la caméra « {camera} » du suivi en a {width} x {height} : choisissez celles qui ont été suivies.</translation>
    </message>
    <message>
        <source>{bone} pose</source>
        <translation>{bone} : pose</translation>
    </message>
    <message>
        <source>{bone} in motion</source>
        <translation>{bone} en mouvement</translation>
    </message>
    <message>
        <source>The track&apos;s structure &apos;{name}&apos; has no segment: assign it in the first section.</source>
        <translation>La structure « {name} » du suivi n&apos;a pas de segment : attribuez-le dans la première section.</translation>
    </message>
    <message>
        <source>The segments of &apos;{name}&apos; hold no voxel: draw them.</source>
        <translation>Les segments de « {name} » ne contiennent aucun voxel : dessinez-les.</translation>
    </message>
    <message>
        <source>The segments of &apos;{name}&apos; are not where they were when the track was made: choose its CT and segmentation, and put them where they were.</source>
        <translation>Les segments de &apos;{name}&apos; ne sont plus là où ils étaient lors du suivi : choisissez le scanner et la segmentation du suivi, et remettez-les en place.</translation>
    </message>
</context>
<context>
    <name>study.track_settings</name>
    <message>
        <source>The track &apos;{name}&apos; of the scene is damaged: delete it, and track again.</source>
        <translation>Le suivi &apos;{name}&apos; de la scène est endommagé : supprimez-le et relancez le suivi.</translation>
    </message>
</context>
<context>
    <name>study.track_writer</name>
    <message>
        <source>The tracking was cancelled.</source>
        <translation>Le suivi a été annulé.</translation>
    </message>
</context>
<context>
    <name>study.writer</name>
    <message>
        <source>The segmentation &apos;{segmentation}&apos; has {count} segments named &apos;{name}&apos;: give the ID of one.</source>
        <translation>La segmentation «&#xa0;{segmentation}&#xa0;» a {count} segments nommés «&#xa0;{name}&#xa0;»&#xa0;: donnez l&apos;identifiant de l&apos;un d&apos;eux.</translation>
    </message>
    <message>
        <source>No CT is chosen: choose a volume.</source>
        <translation>Aucun scanner n&apos;est choisi&#xa0;: choisissez un volume.</translation>
    </message>
    <message>
        <source>No segmentation is chosen: choose that of the CT&apos;s bones.</source>
        <translation>Aucune segmentation n&apos;est choisie&#xa0;: choisissez celle des os du scanner.</translation>
    </message>
    <message>
        <source>No structure is chosen: include at least the anchor and one other bone.</source>
        <translation>Aucune structure n&apos;est choisie&#xa0;: incluez au moins l&apos;ancre et un autre os.</translation>
    </message>
    <message>
        <source>There is no X-ray: add at least one; two from different directions are better.</source>
        <translation>Il n&apos;y a aucune radiographie&#xa0;: ajoutez-en au moins une&#xa0;; deux, de directions différentes, valent mieux.</translation>
    </message>
    <message>
        <source>The segmentation &apos;{segmentation}&apos; has no segment named &apos;{name}&apos;.</source>
        <translation>La segmentation «&#xa0;{segmentation}&#xa0;» n&apos;a pas de segment nommé «&#xa0;{name}&#xa0;».</translation>
    </message>
    <message>
        <source>The anchor &apos;{anchor}&apos; is not one of the structures: choose one of them.</source>
        <translation>L&apos;ancre «&#xa0;{anchor}&#xa0;» n&apos;est pas l&apos;une des structures&#xa0;: choisissez l&apos;une d&apos;elles.</translation>
    </message>
    <message>
        <source>PolyPose needs about {needed:.1f} GB in {folder}, where {free:.1f} GB are free: free some space, or set another temporary folder in Slicer&apos;s settings.</source>
        <translation>PolyPose a besoin d&apos;environ {needed:.1f} Go dans {folder}, où {free:.1f} Go sont libres : libérer de l&apos;espace ou choisir un autre dossier temporaire dans les réglages de Slicer.</translation>
    </message>
    <message>
        <source>The structure &apos;{structure}&apos; has no voxels of its own inside the CT: leave it out, or correct its segments.</source>
        <translation>La structure «&#xa0;{structure}&#xa0;» n&apos;a aucun voxel propre dans le scanner&#xa0;: omettez-la, ou corrigez ses segments.</translation>
    </message>
    <message>
        <source>{file} could not be written completely into {folder}: free some space there, or set another temporary folder in Slicer&apos;s settings.</source>
        <translation>{file} n&apos;a pas pu être écrit entièrement dans {folder}&#xa0;: libérez-y de l&apos;espace, ou choisissez un autre dossier temporaire dans les paramètres de Slicer.</translation>
    </message>
    <message>
        <source>Segment &apos;{segment}&apos; shares {percent:.0f} % of its voxels with other structures, which keep them: correct the segmentation where they overlap.</source>
        <translation>Le segment «&#xa0;{segment}&#xa0;» partage {percent:.0f}&#xa0;% de ses voxels avec d&apos;autres structures, qui les gardent&#xa0;: corrigez la segmentation là où ils se chevauchent.</translation>
    </message>
</context>
<context>
    <name>study.xray_reading</name>
    <message>
        <source>the table of X-rays</source>
        <translation>le tableau des radiographies</translation>
    </message>
    <message>
        <source>initial</source>
        <translation>initiale</translation>
    </message>
    <message>
        <source>ready</source>
        <translation>prête</translation>
    </message>
    <message>
        <source>known exactly</source>
        <translation>connue exactement</translation>
    </message>
    <message>
        <source>none yet: it will be searched for, unless you place the C-arm</source>
        <translation>aucune encore&#xa0;: elle sera cherchée, sauf si vous placez l&apos;arceau</translation>
    </message>
    <message>
        <source>unknown</source>
        <translation>inconnue</translation>
    </message>
    <message>
        <source>not ready</source>
        <translation>pas prête</translation>
    </message>
    <message>
        <source>none yet: an uncertain one was found, review it</source>
        <translation>aucune encore&#xa0;: une caméra incertaine a été trouvée, vérifiez-la</translation>
    </message>
    <message>
        <source>uncertain, accepted by you</source>
        <translation>incertaine, acceptée par vous</translation>
    </message>
    <message>
        <source>initial, from landmarks</source>
        <translation>initiale, d&apos;après les repères</translation>
    </message>
    <message>
        <source>none yet: pick landmarks</source>
        <translation>aucune encore&#xa0;: placez des repères</translation>
    </message>
    <message>
        <source>DICOM</source>
        <translation>DICOM</translation>
    </message>
    <message>
        <source>ready; {count} warnings</source>
        <translation>prête&#xa0;; {count} avertissements</translation>
    </message>
    <message>
        <source>found, within {degrees:.0f} deg and {mm:.0f} mm</source>
        <translation>trouvée, à {degrees:.0f}° et {mm:.0f} mm près</translation>
    </message>
    <message>
        <source>initial, within {degrees:.0f} deg and {mm:.0f} mm</source>
        <translation>initiale, à {degrees:.0f}° et {mm:.0f} mm près</translation>
    </message>
    <message>
        <source>transform</source>
        <translation>transformation</translation>
    </message>
    <message>
        <source>image only</source>
        <translation>image seule</translation>
    </message>
    <message>
        <source>{file} does not describe the geometry of &apos;{xray}&apos;: choose a study file with an entry for it.</source>
        <translation>{file} ne décrit pas la géométrie de «&#xa0;{xray}&#xa0;»&#xa0;: choisissez un fichier d&apos;étude qui a une entrée pour elle.</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>Avertissement&#xa0;: {text}</translation>
    </message>
    <message>
        <source>known, from a file</source>
        <translation>connue, d&apos;après un fichier</translation>
    </message>
    <message>
        <source>geometry file</source>
        <translation>fichier de géométrie</translation>
    </message>
    <message>
        <source>entered</source>
        <translation>saisie</translation>
    </message>
    <message>
        <source>{file} cannot be read as JSON ({reason}): choose a study file.</source>
        <translation>{file} n&apos;est pas lisible comme JSON ({reason})&#xa0;: choisissez un fichier d&apos;étude.</translation>
    </message>
    <message>
        <source>It cannot be read: {reason}.</source>
        <translation>Lecture impossible&#xa0;: {reason}.</translation>
    </message>
</context>
<context>
    <name>study.xray_series</name>
    <message>
        <source>The sequence &apos;{name}&apos; has {count} images, but its file has {in_file}: load it again from its file.</source>
        <translation>La séquence &apos;{name}&apos; a {count} images, mais son fichier en a {in_file} : la recharger depuis son fichier.</translation>
    </message>
    <message>
        <source>Image {number} of the sequence &apos;{name}&apos; has another size, type or spacing than the first: choose a sequence of one camera.</source>
        <translation>L&apos;image {number} de la séquence &apos;{name}&apos; a une autre taille, un autre type ou un autre pas que la première : choisir une séquence d&apos;une seule caméra.</translation>
    </message>
</context>
<context>
    <name>study.xray_source</name>
    <message>
        <source>The stored fields of an X-ray are damaged: remove the X-ray and add it again.</source>
        <translation>Les champs enregistrés d&apos;une radiographie sont endommagés&#xa0;: retirez la radiographie et ajoutez-la de nouveau.</translation>
    </message>
    <message>
        <source>An X-ray needs an image of the scene or a file: choose one.</source>
        <translation>Une radiographie demande une image de la scène ou un fichier&#xa0;: choisissez-en un.</translation>
    </message>
    <message>
        <source>The sequence &apos;{name}&apos; has {count} images: choose one of them as the frame.</source>
        <translation>La séquence «&#xa0;{name}&#xa0;» a {count} images&#xa0;: choisissez l&apos;une d&apos;elles.</translation>
    </message>
    <message>
        <source>The sequence &apos;{name}&apos; does not hold images: choose another.</source>
        <translation>La séquence «&#xa0;{name}&#xa0;» ne contient pas d&apos;images&#xa0;: choisissez-en une autre.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is not an image: choose a volume or a sequence of volumes.</source>
        <translation>«&#xa0;{name}&#xa0;» n&apos;est pas une image&#xa0;: choisissez un volume ou une séquence de volumes.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; has no pixels: load it again.</source>
        <translation>La radiographie «&#xa0;{name}&#xa0;» n&apos;a pas de pixels&#xa0;: chargez-la de nouveau.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is a volume of {count} images: choose one of them as its frame.</source>
        <translation>La radiographie «&#xa0;{name}&#xa0;» est un volume de {count} images&#xa0;: choisissez l&apos;une d&apos;elles.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; has {count} images: choose one of them as its frame.</source>
        <translation>La radiographie «&#xa0;{name}&#xa0;» a {count} images&#xa0;: choisissez l&apos;une d&apos;elles.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is a file and not an image of the scene: load it.</source>
        <translation>La radiographie «&#xa0;{name}&#xa0;» est un fichier et non une image de la scène&#xa0;: chargez-la.</translation>
    </message>
</context>
</TS>
