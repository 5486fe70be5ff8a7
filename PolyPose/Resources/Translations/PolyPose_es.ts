<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="es" sourcelanguage="en">
<context>
    <name>PolyPose</name>
    <message>
        <source>Aligns one CT to two or more X-rays of the same patient in another posture: every bone keeps its shape and gets its own rigid motion, soft tissue follows smoothly. Research software, not for clinical decisions.</source>
        <translation>Alinea una TC con dos o más radiografías del mismo paciente en otra postura: cada hueso conserva su forma y recibe su propio movimiento rígido; los tejidos blandos lo siguen con suavidad. Software de investigación, no apto para decisiones clínicas.</translation>
    </message>
    <message>
        <source>The method is the polyrigid 2D/3D registration of Gopalakrishnan et al. (PolyPose, 2025).</source>
        <translation>El método es el registro polirrígido 2D/3D de Gopalakrishnan et al. (PolyPose, 2025).</translation>
    </message>
    <message>
        <source>Research software, not for clinical decisions.</source>
        <translation>Software de investigación, no apto para decisiones clínicas.</translation>
    </message>
    <message>
        <source>1. CT and bones</source>
        <translation>1. TC y huesos</translation>
    </message>
    <message>
        <source>CT:</source>
        <translation>TC:</translation>
    </message>
    <message>
        <source>The preoperative CT, in Hounsfield units.</source>
        <translation>La TC preoperatoria, en unidades Hounsfield.</translation>
    </message>
    <message>
        <source>Choose the CT</source>
        <translation>Elegir la TC</translation>
    </message>
    <message>
        <source>Segmentation:</source>
        <translation>Segmentación:</translation>
    </message>
    <message>
        <source>Segmentation of the CT with one segment per bone.</source>
        <translation>Segmentación de la TC con un segmento por hueso.</translation>
    </message>
    <message>
        <source>Choose the segmentation</source>
        <translation>Elegir la segmentación</translation>
    </message>
    <message>
        <source>Segment bones</source>
        <translation>Segmentar</translation>
    </message>
    <message>
        <source>Segment the CT with the extension TotalSegmentator or MONAIAuto3DSeg, and propose the structures.</source>
        <translation>Segmentar la TC con la extensión TotalSegmentator o MONAIAuto3DSeg y proponer las estructuras.</translation>
    </message>
    <message>
        <source>Propose structures</source>
        <translation>Proponer estructuras</translation>
    </message>
    <message>
        <source>Give every segment whose name is that of a bone, as TotalSegmentator names them, its usual structure, and choose an anchor.</source>
        <translation>Dar a cada segmento que lleva el nombre de un hueso, según los nombres de TotalSegmentator, su estructura habitual, y elegir un ancla.</translation>
    </message>
    <message>
        <source>How finely the spine and the ribs are divided.</source>
        <translation>Con qué finura se dividen la columna y las costillas.</translation>
    </message>
    <message>
        <source>Spine and ribs by region</source>
        <translation>Columna y costillas por regiones</translation>
    </message>
    <message>
        <source>Every vertebra and rib</source>
        <translation>Cada vértebra y cada costilla</translation>
    </message>
    <message>
        <source>Show only the segments whose name or structure contains this text.</source>
        <translation>Mostrar solo los segmentos cuyo nombre o estructura contiene este texto.</translation>
    </message>
    <message>
        <source>Search segments</source>
        <translation>Buscar segmentos</translation>
    </message>
    <message>
        <source>Included only</source>
        <translation>Solo los incluidos</translation>
    </message>
    <message>
        <source>Hide the segments that do not move as a bone.</source>
        <translation>Ocultar los segmentos que no se mueven como un hueso.</translation>
    </message>
    <message>
        <source>A structure is what moves as one rigid body: segments with the same structure move together. The anchor stays where it is and defines the cameras.</source>
        <translation>Una estructura es lo que se mueve como un solo cuerpo rígido: los segmentos de la misma estructura se mueven juntos. El ancla permanece en su sitio y define las cámaras.</translation>
    </message>
    <message>
        <source>2. X-rays</source>
        <translation>2. Radiografías</translation>
    </message>
    <message>
        <source>A loaded X-ray: a volume of one image, or a sequence of them.</source>
        <translation>Una radiografía cargada: un volumen de una imagen, o una secuencia de ellos.</translation>
    </message>
    <message>
        <source>Loaded X-ray</source>
        <translation>Radiografía cargada</translation>
    </message>
    <message>
        <source>Add</source>
        <translation>Añadir</translation>
    </message>
    <message>
        <source>Add the chosen X-ray to the table.</source>
        <translation>Añadir a la tabla la radiografía elegida.</translation>
    </message>
    <message>
        <source>Add X-rays from files.</source>
        <translation>Añadir radiografías de archivos.</translation>
    </message>
    <message>
        <source>Files...</source>
        <translation>Archivos...</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>Quitar</translation>
    </message>
    <message>
        <source>Take the selected X-ray out of the table; the image itself stays.</source>
        <translation>Quitar de la tabla la radiografía seleccionada; la imagen misma permanece.</translation>
    </message>
    <message>
        <source>Geometry of the selected X-ray</source>
        <translation>Geometría de la radiografía seleccionada</translation>
    </message>
    <message>
        <source>Name:</source>
        <translation>Nombre:</translation>
    </message>
    <message>
        <source>What this X-ray is called in tables and views.</source>
        <translation>Cómo se llama esta radiografía en las tablas y las vistas.</translation>
    </message>
    <message>
        <source>Frame:</source>
        <translation>Imagen n.º:</translation>
    </message>
    <message>
        <source>Which image of the sequence or of the file, counted from 1.</source>
        <translation>Qué imagen de la secuencia o del archivo, contada desde 1.</translation>
    </message>
    <message>
        <source>Camera is:</source>
        <translation>La cámara es:</translation>
    </message>
    <message>
        <source>How the registration treats the camera: as an initial camera to refine, as exactly known, or as unknown.</source>
        <translation>Cómo trata el registro la cámara: como cámara inicial que se refina, como conocida exactamente o como desconocida.</translation>
    </message>
    <message>
        <source>an initial camera</source>
        <translation>una cámara inicial</translation>
    </message>
    <message>
        <source>known exactly</source>
        <translation>conocida exactamente</translation>
    </message>
    <message>
        <source>to be found</source>
        <translation>por buscar</translation>
    </message>
    <message>
        <source>Source to detector [mm]:</source>
        <translation>Fuente a detector [mm]:</translation>
    </message>
    <message>
        <source>Distance from the X-ray source to the detector. Leave it empty to use the value in the file.</source>
        <translation>Distancia de la fuente de rayos X al detector. Déjelo vacío para usar el valor del archivo.</translation>
    </message>
    <message>
        <source>Source to isocentre [mm]:</source>
        <translation>Fuente a isocentro [mm]:</translation>
    </message>
    <message>
        <source>Distance from the X-ray source to the C-arm&apos;s isocentre. Leave it empty to use the value in the file.</source>
        <translation>Distancia de la fuente de rayos X al isocentro del arco en C. Déjelo vacío para usar el valor del archivo.</translation>
    </message>
    <message>
        <source>Distance of pixel centres, between rows and between columns.</source>
        <translation>Distancia entre los centros de los píxeles, entre filas y entre columnas.</translation>
    </message>
    <message>
        <source>Pixel spacing [mm]:</source>
        <translation>Tamaño de píxel [mm]:</translation>
    </message>
    <message>
        <source>Distance between rows on the detector, not at the patient. Leave it empty to use the value in the file.</source>
        <translation>Distancia entre las filas en el detector, no en el paciente. Déjelo vacío para usar el valor del archivo.</translation>
    </message>
    <message>
        <source>Distance between columns on the detector, not at the patient. Leave it empty to use the value in the file.</source>
        <translation>Distancia entre las columnas en el detector, no en el paciente. Déjelo vacío para usar el valor del archivo.</translation>
    </message>
    <message>
        <source>Column and row of the pixel on which the beam is perpendicular, counted from 0.</source>
        <translation>Columna y fila del píxel en el que el haz es perpendicular, contadas desde 0.</translation>
    </message>
    <message>
        <source>Principal point [px]:</source>
        <translation>Punto principal [px]:</translation>
    </message>
    <message>
        <source>Where the perpendicular from the source meets the detector, in the file&apos;s own pixels; the first pixel&apos;s centre is 0. Leave it empty for the centre of the image, or the value in the file.</source>
        <translation>Dónde la perpendicular desde la fuente encuentra el detector, en píxeles del archivo; el centro del primer píxel es 0. Déjelo vacío para el centro de la imagen o el valor del archivo.</translation>
    </message>
    <message>
        <source>The row of the same point.</source>
        <translation>La fila del mismo punto.</translation>
    </message>
    <message>
        <source>LAO + / RAO - [deg]:</source>
        <translation>LAO + / RAO - [deg]:</translation>
    </message>
    <message>
        <source>Primary angle of the C-arm; positive with the detector toward the patient&apos;s left (LAO). Leave it empty to use the value in the file.</source>
        <translation>Ángulo primario del arco en C; positivo con el detector hacia la izquierda del paciente (LAO). Déjelo vacío para usar el valor del archivo.</translation>
    </message>
    <message>
        <source>CRA + / CAU - [deg]:</source>
        <translation>CRA + / CAU - [deg]:</translation>
    </message>
    <message>
        <source>Secondary angle of the C-arm; positive with the detector toward the head (CRA). Leave it empty to use the value in the file.</source>
        <translation>Ángulo secundario del arco en C; positivo con el detector hacia la cabeza (CRA). Déjelo vacío para usar el valor del archivo.</translation>
    </message>
    <message>
        <source>Patient position:</source>
        <translation>Posición del paciente:</translation>
    </message>
    <message>
        <source>Head or feet first; supine, prone or on one side. Used with angles that are entered here.</source>
        <translation>Cabeza o pies primero; decúbito supino, prono o lateral. Se usa con los ángulos introducidos aquí.</translation>
    </message>
    <message>
        <source>Image seen from:</source>
        <translation>Imagen vista desde:</translation>
    </message>
    <message>
        <source>C-arms display the image as seen from the detector; a film on a view box may be the other way round.</source>
        <translation>Los arcos en C muestran la imagen vista desde el detector; una placa en un negatoscopio puede estar al revés.</translation>
    </message>
    <message>
        <source>as in the file</source>
        <translation>como en el archivo</translation>
    </message>
    <message>
        <source>the detector (mirrored)</source>
        <translation>el detector (reflejada)</translation>
    </message>
    <message>
        <source>the source</source>
        <translation>la fuente</translation>
    </message>
    <message>
        <source>Distortion:</source>
        <translation>Distorsión:</translation>
    </message>
    <message>
        <source>Image intensifiers bend straight lines. An image with a round field counts as distorted, and its uncertainties are wider, unless it was corrected.</source>
        <translation>Los intensificadores de imagen curvan las líneas rectas. Una imagen de campo redondo se considera distorsionada, y sus incertidumbres son mayores, a menos que se haya corregido.</translation>
    </message>
    <message>
        <source>by the field&apos;s shape</source>
        <translation>según la forma del campo</translation>
    </message>
    <message>
        <source>corrected</source>
        <translation>corregida</translation>
    </message>
    <message>
        <source>not corrected</source>
        <translation>no corregida</translation>
    </message>
    <message>
        <source>Camera&apos;s transform:</source>
        <translation>Transformación:</translation>
    </message>
    <message>
        <source>A transform from the camera&apos;s axes (x along the columns, y down the rows, z toward the detector) to the patient; it is made by &apos;Use as initial camera&apos;.</source>
        <translation>Una transformación de los ejes de la cámara (x a lo largo de las columnas, y filas abajo, z hacia el detector) al paciente; la crea «Usar como cámara inicial».</translation>
    </message>
    <message>
        <source>None</source>
        <translation>Ninguna</translation>
    </message>
    <message>
        <source>Read geometry from a file...</source>
        <translation>Geometría de un archivo...</translation>
    </message>
    <message>
        <source>Take distances, angles and the camera from a study file (JSON), for the X-ray of the same name or place in it.</source>
        <translation>Tomar distancias, ángulos y la cámara de un archivo de estudio (JSON), para la radiografía del mismo nombre o lugar en él.</translation>
    </message>
    <message>
        <source>Clear entered geometry</source>
        <translation>Borrar lo introducido</translation>
    </message>
    <message>
        <source>Use the values in the image&apos;s own file again.</source>
        <translation>Usar de nuevo los valores del archivo de la imagen.</translation>
    </message>
    <message>
        <source>3. Initial cameras (optional)</source>
        <translation>3. Cámaras iniciales (opcional)</translation>
    </message>
    <message>
        <source>Where the registration of the selected X-ray starts; it refines every camera that is not known exactly.</source>
        <translation>De dónde parte el registro de la radiografía seleccionada; refina toda cámara que no se conozca exactamente.</translation>
    </message>
    <message>
        <source>Camera source:</source>
        <translation>Fuente de la cámara:</translation>
    </message>
    <message>
        <source>Where the initial camera of the selected X-ray comes from.</source>
        <translation>De dónde viene la cámara inicial de la radiografía seleccionada.</translation>
    </message>
    <message>
        <source>Search near:</source>
        <translation>Buscar cerca de:</translation>
    </message>
    <message>
        <source>The view as it was ordered; the search stays within 45 degrees of it. Position of the detector: AP behind the patient, PA in front, LL at the left side, RL at the right side.</source>
        <translation>La proyección tal como se solicitó; la búsqueda se queda a menos de 45 grados de ella. Posición del detector: AP detrás del paciente, PA delante, LL en el lado izquierdo, RL en el lado derecho.</translation>
    </message>
    <message>
        <source>Calibration:</source>
        <translation>Calibración:</translation>
    </message>
    <message>
        <source>A calibrated camera: a 3x4 projection matrix (CSV or JSON), a MayaCam 2.0 text, or intrinsics with distortion (JSON). Its pose is used only when the calibration is the camera source; it must then be given in the CT&apos;s coordinates (LPS, mm).</source>
        <translation>Una cámara calibrada: una matriz de proyección 3x4 (CSV o JSON), un texto de MayaCam 2.0, o parámetros intrínsecos con distorsión (JSON). Su pose solo se usa cuando la calibración es la fuente de la cámara; entonces debe estar dada en las coordenadas de la TC (LPS, mm).</translation>
    </message>
    <message>
        <source>Camera model:</source>
        <translation>Modelo de cámara:</translation>
    </message>
    <message>
        <source>A model trained by python -m PolyPoseLib train on this CT and this anchor; models of other CTs are refused.</source>
        <translation>Un modelo entrenado por python -m PolyPoseLib train con esta TC y esta ancla; se rechazan los modelos de otras TC.</translation>
    </message>
    <message>
        <source>Rig:</source>
        <translation>Montaje:</translation>
    </message>
    <message>
        <source>none: this camera is independent</source>
        <translation>ninguno: esta cámara es independiente</translation>
    </message>
    <message>
        <source>Name of the calibrated rig, such as a biplane stand, that took this X-ray. Give the same name to the other X-rays of the rig: their cameras keep the relative pose of their calibrations, and what is found for one places the others.</source>
        <translation>Nombre del montaje calibrado, como un soporte biplano, que tomó esta radiografía. Dé el mismo nombre a las demás radiografías del montaje: sus cámaras conservan la pose relativa de sus calibraciones, y lo que se encuentra para una coloca las demás.</translation>
    </message>
    <message>
        <source>Landmarks</source>
        <translation>Puntos de referencia</translation>
    </message>
    <message>
        <source>Pick four or more points on the anchor, far apart and not in one line, in the CT and in the X-ray. Points with the same name form a pair.</source>
        <translation>Coloque cuatro o más puntos en el ancla, alejados entre sí y no alineados, en la TC y en la radiografía. Los puntos del mismo nombre forman un par.</translation>
    </message>
    <message>
        <source>In the CT:</source>
        <translation>En la TC:</translation>
    </message>
    <message>
        <source>Points in the CT; X-rays may share a list.</source>
        <translation>Puntos en la TC; las radiografías pueden compartir una lista.</translation>
    </message>
    <message>
        <source>None yet</source>
        <translation>Ninguna aún</translation>
    </message>
    <message>
        <source>Pick</source>
        <translation>Colocar</translation>
    </message>
    <message>
        <source>Pick points in the slices or on the bones in 3D; press again, or click the right mouse button, to end.</source>
        <translation>Colocar puntos en los cortes o sobre los huesos en 3D; pulse de nuevo, o haga clic con el botón derecho del ratón, para terminar.</translation>
    </message>
    <message>
        <source>In the X-ray:</source>
        <translation>En la radiografía:</translation>
    </message>
    <message>
        <source>Points in this X-ray; each X-ray has its own list.</source>
        <translation>Puntos en esta radiografía; cada radiografía tiene su propia lista.</translation>
    </message>
    <message>
        <source>Show the X-ray in its own view, and pick points there; press again, or click the right mouse button, to end.</source>
        <translation>Mostrar la radiografía en su propia vista y colocar puntos en ella; pulse de nuevo, o haga clic con el botón derecho del ratón, para terminar.</translation>
    </message>
    <message>
        <source>How far each landmark of the CT projects from its counterpart in the X-ray: in mm at its depth, and in pixels.</source>
        <translation>A qué distancia de su homólogo en la radiografía se proyecta cada punto de referencia de la TC: en mm a su profundidad, y en píxeles.</translation>
    </message>
    <message>
        <source>Remove pair</source>
        <translation>Quitar par</translation>
    </message>
    <message>
        <source>Delete the selected landmark from both lists.</source>
        <translation>Borrar de ambas listas el punto de referencia seleccionado.</translation>
    </message>
    <message>
        <source>Find camera</source>
        <translation>Buscar cámara</translation>
    </message>
    <message>
        <source>Find the camera of the selected X-ray; without it, the registration searches when it starts.</source>
        <translation>Buscar la cámara de la radiografía seleccionada; si no, el registro la busca al comenzar.</translation>
    </message>
    <message>
        <source>Find all</source>
        <translation>Buscar todas</translation>
    </message>
    <message>
        <source>Find the camera of every X-ray that has none.</source>
        <translation>Buscar la cámara de cada radiografía que no la tiene.</translation>
    </message>
    <message>
        <source>Show</source>
        <translation>Mostrar</translation>
    </message>
    <message>
        <source>Show the CT rendered by this camera over the X-ray, and the C-arm in 3D.</source>
        <translation>Mostrar la TC renderizada con esta cámara sobre la radiografía, y el arco en C en 3D.</translation>
    </message>
    <message>
        <source>Accept</source>
        <translation>Aceptar</translation>
    </message>
    <message>
        <source>Start the registration from this uncertain camera.</source>
        <translation>Comenzar el registro desde esta cámara incierta.</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>Descartar</translation>
    </message>
    <message>
        <source>Discard the camera that was found.</source>
        <translation>Descartar la cámara encontrada.</translation>
    </message>
    <message>
        <source>4. Place the C-arm (optional)</source>
        <translation>4. Colocar el arco en C (opcional)</translation>
    </message>
    <message>
        <source>Move the sliders until the rendering of the CT lies on the X-ray. It need not be exact: the registration refines it.</source>
        <translation>Mueva los controles hasta que el renderizado de la TC coincida con la radiografía. No hace falta que sea exacto: el registro lo refina.</translation>
    </message>
    <message>
        <source>LAO + / RAO -:</source>
        <translation>LAO + / RAO -:</translation>
    </message>
    <message>
        <source>Primary angle; positive with the detector toward the patient&apos;s left.</source>
        <translation>Ángulo primario; positivo con el detector hacia la izquierda del paciente.</translation>
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
        <translation>Ángulo secundario; positivo con el detector hacia la cabeza.</translation>
    </message>
    <message>
        <source>Image rotation:</source>
        <translation>Rotación de la imagen:</translation>
    </message>
    <message>
        <source>Rotation of the detector about the beam.</source>
        <translation>Rotación del detector en torno al haz.</translation>
    </message>
    <message>
        <source>Source to isocentre:</source>
        <translation>Fuente a isocentro:</translation>
    </message>
    <message>
        <source>Distance from the source to the isocentre.</source>
        <translation>Distancia de la fuente al isocentro.</translation>
    </message>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>Source to detector:</source>
        <translation>Fuente a detector:</translation>
    </message>
    <message>
        <source>Distance from the source to the detector.</source>
        <translation>Distancia de la fuente al detector.</translation>
    </message>
    <message>
        <source>Table to the left:</source>
        <translation>Mesa a la izquierda:</translation>
    </message>
    <message>
        <source>How far the patient lies to his or her left of the isocentre.</source>
        <translation>Cuánto se encuentra el paciente a su izquierda del isocentro.</translation>
    </message>
    <message>
        <source>Table to the front:</source>
        <translation>Mesa hacia delante:</translation>
    </message>
    <message>
        <source>How far the patient lies to the front of the isocentre.</source>
        <translation>Cuánto se encuentra el paciente por delante del isocentro.</translation>
    </message>
    <message>
        <source>Table to the head:</source>
        <translation>Mesa hacia la cabeza:</translation>
    </message>
    <message>
        <source>How far the patient lies toward the head from the isocentre.</source>
        <translation>Cuánto se encuentra el paciente hacia la cabeza desde el isocentro.</translation>
    </message>
    <message>
        <source>Overlay:</source>
        <translation>Superposición:</translation>
    </message>
    <message>
        <source>How much of the rendering is seen over the X-ray.</source>
        <translation>Cuánto se ve el renderizado sobre la radiografía.</translation>
    </message>
    <message>
        <source> %</source>
        <translation> %</translation>
    </message>
    <message>
        <source>Show live</source>
        <translation>Mostrar en vivo</translation>
    </message>
    <message>
        <source>Render the CT over the selected X-ray while the sliders move.</source>
        <translation>Renderizar la TC sobre la radiografía seleccionada mientras se mueven los controles.</translation>
    </message>
    <message>
        <source>Back to what the X-ray&apos;s own geometry says.</source>
        <translation>Volver a lo que dice la geometría propia de la radiografía.</translation>
    </message>
    <message>
        <source>Reset</source>
        <translation>Restablecer</translation>
    </message>
    <message>
        <source>Use as initial camera</source>
        <translation>Usar como cámara inicial</translation>
    </message>
    <message>
        <source>Start the registration of this X-ray from the camera that is shown.</source>
        <translation>Comenzar el registro de esta radiografía desde la cámara mostrada.</translation>
    </message>
    <message>
        <source>5. Settings</source>
        <translation>5. Ajustes</translation>
    </message>
    <message>
        <source>Preset:</source>
        <translation>Preajuste:</translation>
    </message>
    <message>
        <source>How thorough the registration is.</source>
        <translation>Cuán minucioso es el registro.</translation>
    </message>
    <message>
        <source>Compute on:</source>
        <translation>Calcular en:</translation>
    </message>
    <message>
        <source>A graphics card is used when there is one, unless the processor is chosen.</source>
        <translation>Se usa la tarjeta gráfica si la hay, a menos que se elija el procesador.</translation>
    </message>
    <message>
        <source>Show the curve of the similarity beside the slices.</source>
        <translation>Mostrar la curva de similitud junto a los cortes.</translation>
    </message>
    <message>
        <source>Show the similarity in the layout</source>
        <translation>Mostrar la similitud en la disposición</translation>
    </message>
    <message>
        <source>Advanced</source>
        <translation>Avanzado</translation>
    </message>
    <message>
        <source>Update the slices while it runs</source>
        <translation>Actualizar los cortes durante el cálculo</translation>
    </message>
    <message>
        <source>Refresh the transform while the registration runs.</source>
        <translation>Refrescar la transformación mientras se ejecuta el registro.</translation>
    </message>
    <message>
        <source>Refine the cameras</source>
        <translation>Refinar las cámaras</translation>
    </message>
    <message>
        <source>Refine the cameras by aligning the anchor before the other bones move.</source>
        <translation>Refinar las cámaras alineando el ancla antes de que se muevan los demás huesos.</translation>
    </message>
    <message>
        <source>Compute uncertainty</source>
        <translation>Calcular la incertidumbre</translation>
    </message>
    <message>
        <source>Estimate the uncertainty of each motion; takes a little longer.</source>
        <translation>Estimar la incertidumbre de cada movimiento; tarda un poco más.</translation>
    </message>
    <message>
        <source>Threads:</source>
        <translation>Hilos:</translation>
    </message>
    <message>
        <source>Number of processor threads.</source>
        <translation>Número de hilos del procesador.</translation>
    </message>
    <message>
        <source>all</source>
        <translation>todos</translation>
    </message>
    <message>
        <source>Random seed:</source>
        <translation>Semilla aleatoria:</translation>
    </message>
    <message>
        <source>The same seed gives the same result on the same machine.</source>
        <translation>La misma semilla da el mismo resultado en la misma máquina.</translation>
    </message>
    <message>
        <source>Keep the result folder in:</source>
        <translation>Guardar el resultado en:</translation>
    </message>
    <message>
        <source>A new folder in which to keep result.json, the ITK transform and the images. Leave it empty to keep only the nodes in the scene.</source>
        <translation>Una carpeta nueva en la que guardar result.json, la transformación ITK y las imágenes. Déjelo vacío para conservar solo los nodos de la escena.</translation>
    </message>
    <message>
        <source>6. Review</source>
        <translation>6. Revisión</translation>
    </message>
    <message>
        <source>Show PolyPose layout</source>
        <translation>Disposición de PolyPose</translation>
    </message>
    <message>
        <source>X-rays in a row, the 3D view with the C-arms, and the three slices.</source>
        <translation>Las radiografías en fila, la vista 3D con los arcos en C y los tres cortes.</translation>
    </message>
    <message>
        <source>Load result...</source>
        <translation>Cargar resultado...</translation>
    </message>
    <message>
        <source>Open the folder of an earlier registration.</source>
        <translation>Abrir la carpeta de un registro anterior.</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Deshacer</translation>
    </message>
    <message>
        <source>Compare</source>
        <translation>Comparar</translation>
    </message>
    <message>
        <source>CT and bones</source>
        <translation>TC y huesos</translation>
    </message>
    <message>
        <source>Before (as in the CT)</source>
        <translation>Antes (TC)</translation>
    </message>
    <message>
        <source>Show the CT and its segmentation where they were scanned (Ctrl+Shift+B swaps).</source>
        <translation>Mostrar la TC y su segmentación donde se adquirieron (Ctrl+Shift+B alterna).</translation>
    </message>
    <message>
        <source>After (as in the X-rays)</source>
        <translation>Después (radiografías)</translation>
    </message>
    <message>
        <source>Show the CT and its segmentation in the posture of the X-rays, through the transform.</source>
        <translation>Mostrar la TC y su segmentación en la postura de las radiografías, a través de la transformación.</translation>
    </message>
    <message>
        <source>Only the bones that move</source>
        <translation>Solo los huesos móviles</translation>
    </message>
    <message>
        <source>Hide the segments that belong to no structure.</source>
        <translation>Ocultar los segmentos que no pertenecen a ninguna estructura.</translation>
    </message>
    <message>
        <source>Bones in 3D</source>
        <translation>Huesos en 3D</translation>
    </message>
    <message>
        <source>Show the bones that move as surfaces in the 3D view, where the chosen posture has them.</source>
        <translation>Mostrar los huesos que se mueven como superficies en la vista 3D, según la postura elegida.</translation>
    </message>
    <message>
        <source>X-ray versus rendering</source>
        <translation>Radiografía y renderizado</translation>
    </message>
    <message>
        <source>View:</source>
        <translation>Vista:</translation>
    </message>
    <message>
        <source>The X-ray to compare with its rendering.</source>
        <translation>La radiografía que se compara con su renderizado.</translation>
    </message>
    <message>
        <source>Compare by:</source>
        <translation>Comparar por:</translation>
    </message>
    <message>
        <source>How X-ray and rendering are shown in one image.</source>
        <translation>Cómo se muestran radiografía y renderizado en una sola imagen.</translation>
    </message>
    <message>
        <source>Blend</source>
        <translation>Fundido</translation>
    </message>
    <message>
        <source>Checkerboard</source>
        <translation>Tablero de ajedrez</translation>
    </message>
    <message>
        <source>Flicker</source>
        <translation>Parpadeo</translation>
    </message>
    <message>
        <source>Edges of the rendering</source>
        <translation>Bordes del renderizado</translation>
    </message>
    <message>
        <source>X-ray alone</source>
        <translation>Solo la radiografía</translation>
    </message>
    <message>
        <source>Rendering alone</source>
        <translation>Solo el renderizado</translation>
    </message>
    <message>
        <source>Amount:</source>
        <translation>Cantidad:</translation>
    </message>
    <message>
        <source>Share of the rendering in a blend; size of the squares; strength of the edges.</source>
        <translation>Proporción del renderizado en el fundido; tamaño de los cuadros; fuerza de los bordes.</translation>
    </message>
    <message>
        <source>Seen from the detector, as C-arms display</source>
        <translation>Visto desde el detector, como en los arcos en C</translation>
    </message>
    <message>
        <source>Off: as seen from the X-ray source.</source>
        <translation>Desactivado: visto desde la fuente de rayos X.</translation>
    </message>
    <message>
        <source>Deformation</source>
        <translation>Deformación</translation>
    </message>
    <message>
        <source>Grid</source>
        <translation>Cuadrícula</translation>
    </message>
    <message>
        <source>Show the deformation as a grid, in the slices.</source>
        <translation>Mostrar la deformación como cuadrícula en los cortes.</translation>
    </message>
    <message>
        <source>Show the deformation as arrows, in the slices and in 3D.</source>
        <translation>Mostrar la deformación como flechas en los cortes y en 3D.</translation>
    </message>
    <message>
        <source>Arrows</source>
        <translation>Flechas</translation>
    </message>
    <message>
        <source>One row per X-ray: where its geometry comes from and how reliable it is. Image files, and loaded X-rays from a tree of the data, can be dropped here.</source>
        <translation>Una fila por radiografía: de dónde procede su geometría y qué fiabilidad tiene. Se pueden soltar aquí archivos de imagen y radiografías cargadas de un árbol de datos.</translation>
    </message>
    <message>
        <source>Volume change</source>
        <translation>Cambio de volumen</translation>
    </message>
    <message>
        <source>Show by colour where tissue grows or shrinks (Jacobian determinant); folds are marked.</source>
        <translation>Mostrar con colores dónde el tejido crece o se encoge (determinante jacobiano); los pliegues están marcados.</translation>
    </message>
    <message>
        <source>Weight of:</source>
        <translation>Peso de:</translation>
    </message>
    <message>
        <source>Show how strongly a structure&apos;s motion influences each point.</source>
        <translation>Mostrar con qué fuerza influye el movimiento de una estructura en cada punto.</translation>
    </message>
    <message>
        <source>Motions</source>
        <translation>Movimientos</translation>
    </message>
    <message>
        <source>Motions of the bones</source>
        <translation>Movimientos de los huesos</translation>
    </message>
    <message>
        <source>Relative to:</source>
        <translation>Respecto a:</translation>
    </message>
    <message>
        <source>Motions are shown as seen from this structure.</source>
        <translation>Los movimientos se muestran vistos desde esta estructura.</translation>
    </message>
    <message>
        <source>Rotation, displacement of the centroid and axis of each structure, from the CT to the X-rays.</source>
        <translation>Rotación, desplazamiento del centroide y eje de cada estructura, de la TC a las radiografías.</translation>
    </message>
    <message>
        <source>Copy</source>
        <translation>Copiar</translation>
    </message>
    <message>
        <source>Copy the table, ready to be pasted into a spreadsheet.</source>
        <translation>Copiar la tabla, lista para pegarla en una hoja de cálculo.</translation>
    </message>
    <message>
        <source>Save as CSV...</source>
        <translation>Guardar como CSV...</translation>
    </message>
    <message>
        <source>Write the table into a file.</source>
        <translation>Escribir la tabla en un archivo.</translation>
    </message>
    <message>
        <source>Save report...</source>
        <translation>Guardar informe...</translation>
    </message>
    <message>
        <source>Write one HTML page with inputs, motions, pictures and warnings.</source>
        <translation>Escribir una página HTML con las entradas, los movimientos, las imágenes y las advertencias.</translation>
    </message>
    <message>
        <source>Save result as a scene...</source>
        <translation>Guardar como escena...</translation>
    </message>
    <message>
        <source>Write the CT, its segmentation and the result alone into a scene of their own (.mrb), which opens in any Slicer, without this module too.</source>
        <translation>Escribir solo la TC, su segmentación y el resultado en una escena propia (.mrb), que se abre en cualquier Slicer, también sin este módulo.</translation>
    </message>
    <message>
        <source>Carry</source>
        <translation>Llevar</translation>
    </message>
    <message>
        <source>Carry along</source>
        <translation>Llevar consigo</translation>
    </message>
    <message>
        <source>Markups, models, segmentations, volumes and RT doses of the CT: what is checked follows Before and After, and the registration while it runs.</source>
        <translation>Marcas, modelos, segmentaciones, volúmenes y dosis RT de la TC: lo marcado sigue a Antes y Después, y al registro mientras se ejecuta.</translation>
    </message>
    <message>
        <source>95 % ellipsoids of points</source>
        <translation>Elipsoides del 95 % de los puntos</translation>
    </message>
    <message>
        <source>How far each carried point may be off, in 3D and in the slices; shown with After.</source>
        <translation>Cuánto puede desviarse cada punto llevado, en 3D y en los cortes; se muestra con Después.</translation>
    </message>
    <message>
        <source>Result for planning systems</source>
        <translation>Resultado para sistemas de planificación</translation>
    </message>
    <message>
        <source>Export as DICOM...</source>
        <translation>Exportar como DICOM...</translation>
    </message>
    <message>
        <source>Write the warped CT, the segmentation, every bone&apos;s motion and the deformation as DICOM objects, for planning systems.</source>
        <translation>Escribir la TC deformada, la segmentación, el movimiento de cada hueso y la deformación como objetos DICOM, para sistemas de planificación.</translation>
    </message>
    <message>
        <source>Adjust</source>
        <translation>Ajustar</translation>
    </message>
    <message>
        <source>Bones moved by hand</source>
        <translation>Huesos movidos a mano</translation>
    </message>
    <message>
        <source>The bone that the handles move.</source>
        <translation>El hueso que mueven los tiradores.</translation>
    </message>
    <message>
        <source>Show handles</source>
        <translation>Mostrar tiradores</translation>
    </message>
    <message>
        <source>Show Slicer&apos;s handles on this bone, in 3D and in the slices, and its outline on the X-rays.</source>
        <translation>Mostrar los tiradores de Slicer en este hueso, en 3D y en los cortes, y su contorno en las radiografías.</translation>
    </message>
    <message>
        <source>Put back</source>
        <translation>Devolver</translation>
    </message>
    <message>
        <source>Put all bones back where the result has them.</source>
        <translation>Devolver todos los huesos adonde los tiene el resultado.</translation>
    </message>
    <message>
        <source>Refine from here</source>
        <translation>Refinar desde aquí</translation>
    </message>
    <message>
        <source>Fit cameras and bones again from where they are now; Undo brings this result back.</source>
        <translation>Ajustar de nuevo las cámaras y los huesos desde donde están ahora; «Deshacer» recupera este resultado.</translation>
    </message>
    <message>
        <source>7. Motion</source>
        <translation>7. Movimiento</translation>
    </message>
    <message>
        <source>Frames per second:</source>
        <translation>Imágenes por segundo:</translation>
    </message>
    <message>
        <source>Of all cameras. Where it is left alone, it is what DICOM or the times of the images state.</source>
        <translation>De todas las cámaras. Si no se toca, es lo que indican DICOM o los tiempos de las imágenes.</translation>
    </message>
    <message>
        <source>as the images state</source>
        <translation>como indican las imágenes</translation>
    </message>
    <message>
        <source>Frames:</source>
        <translation>Instantes:</translation>
    </message>
    <message>
        <source>The first frame that is tracked, counted from 0. Frame 0 is the first that all cameras have; the images that the X-rays show (Frame) belong together.</source>
        <translation>El primer instante que se sigue, contado desde 0. El instante 0 es el primero que tienen todas las cámaras; las imágenes que muestran las radiografías (Imagen) van juntas.</translation>
    </message>
    <message>
        <source>to</source>
        <translation>a</translation>
    </message>
    <message>
        <source>The last frame that is tracked.</source>
        <translation>El último instante que se sigue.</translation>
    </message>
    <message>
        <source>Reference:</source>
        <translation>Referencia:</translation>
    </message>
    <message>
        <source>The structure relative to which the motion of the others is reported; it moves, too.</source>
        <translation>La estructura respecto a la cual se indica el movimiento de las demás; también se mueve.</translation>
    </message>
    <message>
        <source>Start:</source>
        <translation>Inicio:</translation>
    </message>
    <message>
        <source>Where the bones are looked for in the first frame.</source>
        <translation>Dónde se buscan los huesos en el primer instante.</translation>
    </message>
    <message>
        <source>Standing still:</source>
        <translation>Inmóviles:</translation>
    </message>
    <message>
        <source>Structures that do not move during the sequence.</source>
        <translation>Estructuras que no se mueven durante la secuencia.</translation>
    </message>
    <message>
        <source>Go back once more, and keep the better poses</source>
        <translation>Volver atrás y conservar las mejores poses</translation>
    </message>
    <message>
        <source>A second pass goes from the last frame to the first; it finds bones again that were lost behind others.</source>
        <translation>Una segunda pasada va del último instante al primero; vuelve a encontrar huesos que se perdieron detrás de otros.</translation>
    </message>
    <message>
        <source>Smooth the poses</source>
        <translation>Suavizar las poses</translation>
    </message>
    <message>
        <source>Smooth the poses with their own uncertainty. A smoothed track cannot be corrected afterwards.</source>
        <translation>Suavizar las poses con su propia incertidumbre. Un seguimiento suavizado no se puede corregir después.</translation>
    </message>
    <message>
        <source>Track</source>
        <translation>Seguir</translation>
    </message>
    <message>
        <source>Go on</source>
        <translation>Continuar</translation>
    </message>
    <message>
        <source>Go on with the frames that the interrupted tracking has left.</source>
        <translation>Continuar con los instantes que dejó el seguimiento interrumpido.</translation>
    </message>
    <message>
        <source>Tracked</source>
        <translation>Seguimiento</translation>
    </message>
    <message>
        <source>Previous doubtful</source>
        <translation>Dudoso anterior</translation>
    </message>
    <message>
        <source>Go to the frame before this one whose poses are doubtful.</source>
        <translation>Ir al instante anterior cuyas poses son dudosas.</translation>
    </message>
    <message>
        <source>Next doubtful</source>
        <translation>Dudoso siguiente</translation>
    </message>
    <message>
        <source>Go to the frame after this one whose poses are doubtful.</source>
        <translation>Ir al instante siguiente cuyas poses son dudosas.</translation>
    </message>
    <message>
        <source>The bone that is corrected.</source>
        <translation>El hueso que se corrige.</translation>
    </message>
    <message>
        <source>Correct</source>
        <translation>Corregir</translation>
    </message>
    <message>
        <source>Show handles on this bone: drag it until its outlines match the X-rays. It belongs to this frame, and is kept when you go to another one.</source>
        <translation>Mostrar manejadores en este hueso: arrastrarlo hasta que sus contornos coincidan con las radiografías. La corrección pertenece a este instante y se conserva al pasar a otro.</translation>
    </message>
    <message>
        <source>Undo correction</source>
        <translation>Deshacer</translation>
    </message>
    <message>
        <source>Put the bone back where the track has it in this frame.</source>
        <translation>Devolver el hueso adonde lo tiene el seguimiento en este instante.</translation>
    </message>
    <message>
        <source>Which frames are tracked anew from the corrected one on.</source>
        <translation>Qué instantes se siguen de nuevo desde el corregido.</translation>
    </message>
    <message>
        <source>Track on from here</source>
        <translation>Seguir desde aquí</translation>
    </message>
    <message>
        <source>Track anew from the bones that were corrected in this frame; other frames are kept.</source>
        <translation>Seguir de nuevo desde los huesos corregidos en este instante; los demás instantes se conservan.</translation>
    </message>
    <message>
        <source>Show plots</source>
        <translation>Mostrar gráficas</translation>
    </message>
    <message>
        <source>Show the X-rays with outlines, the bones, and plots of their motion.</source>
        <translation>Mostrar las radiografías con contornos, los huesos y las gráficas de su movimiento.</translation>
    </message>
    <message>
        <source>Save track...</source>
        <translation>Guardar seguimiento...</translation>
    </message>
    <message>
        <source>Write the track into a folder, as the command line does.</source>
        <translation>Escribir el seguimiento en una carpeta, como hace la línea de órdenes.</translation>
    </message>
    <message>
        <source>Register</source>
        <translation>Registrar</translation>
    </message>
</context>
<context>
    <name>PolyPoseSlicer.calls</name>
    <message>
        <source>There is no result whose bones could be refined: register first.</source>
        <translation>No hay ningún resultado cuyos huesos puedan refinarse: registre primero.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is both an input and an output: choose another node for the output.</source>
        <translation>«{name}» es a la vez entrada y salida: elija otro nodo para la salida.</translation>
    </message>
</context>
<context>
    <name>PolyPoseSlicer.samples</name>
    <message>
        <source>PolyPose simulates two X-rays of the sample...</source>
        <translation>PolyPose simula dos radiografías del ejemplo...</translation>
    </message>
    <message>
        <source>{program} could not be started ({reason}): install Slicer again.</source>
        <translation>No se pudo iniciar {program} ({reason}): instale Slicer de nuevo.</translation>
    </message>
</context>
<context>
    <name>panel.adjustment</name>
    <message>
        <source>Move a bone with the handles in 3D and in the slices: its outline on the X-rays follows. Then refine: all bones are fitted from where they are, and none is looked for elsewhere.</source>
        <translation>Mueva un hueso con los tiradores en 3D y en los cortes: su contorno en las radiografías lo sigue. Después refine: todos los huesos se ajustan desde donde están, y ninguno se busca en otro lugar.</translation>
    </message>
    <message>
        <source>Bones can be adjusted once there is a result.</source>
        <translation>Los huesos pueden ajustarse en cuanto hay un resultado.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; has no voxel in the warped segmentation: register again, or choose another bone.</source>
        <translation>«{name}» no tiene ningún vóxel en la segmentación deformada: registre de nuevo, o elija otro hueso.</translation>
    </message>
</context>
<context>
    <name>panel.camera_text</name>
    <message>
        <source>No other view scores nearly as high.</source>
        <translation>Ninguna otra vista obtiene una puntuación cercana.</translation>
    </message>
    <message>
        <source>This X-ray is not ready: complete its geometry above.</source>
        <translation>Esta radiografía no está lista: complete su geometría más arriba.</translation>
    </message>
    <message>
        <source>The pose in the calibration is used; it must be given in the CT&apos;s coordinates (LPS, mm).</source>
        <translation>Se usa la pose de la calibración; debe estar dada en las coordenadas de la TC (LPS, mm).</translation>
    </message>
    <message>
        <source>Its file gives no angles: choose another camera source.</source>
        <translation>Su archivo no indica ángulos: elija otra fuente de cámara.</translation>
    </message>
    <message>
        <source>Choose the model file; python -m PolyPoseLib train makes one for this CT.</source>
        <translation>Elija el archivo del modelo; python -m PolyPoseLib train crea uno para esta TC.</translation>
    </message>
    <message>
        <source>Not searched for yet: press Find camera, or the registration will search when it starts.</source>
        <translation>Aún no se ha buscado: pulse «Buscar cámara», o el registro la buscará al comenzar.</translation>
    </message>
    <message>
        <source>Found: {how}.</source>
        <translation>Encontrada: {how}.</translation>
    </message>
    <message>
        <source>Expected accuracy: {degrees:.0f} deg and {mm:.0f} mm.</source>
        <translation>Exactitud esperada: {degrees:.0f}° y {mm:.0f} mm.</translation>
    </message>
    <message>
        <source>It is uncertain, and in use because you accepted it.</source>
        <translation>Es incierta, y se usa porque usted la aceptó.</translation>
    </message>
    <message>
        <source>It is uncertain and not in use: show it, then accept or discard it.</source>
        <translation>Es incierta y no se usa: muéstrela y después acéptela o descártela.</translation>
    </message>
    <message>
        <source>Choose the calibration file.</source>
        <translation>Elija el archivo de calibración.</translation>
    </message>
</context>
<context>
    <name>panel.cameras</name>
    <message>
        <source>Find camera</source>
        <translation>Buscar cámara</translation>
    </message>
    <message>
        <source>all directions</source>
        <translation>todas las direcciones</translation>
    </message>
    <message>
        <source>Calibration files</source>
        <translation>Archivos de calibración</translation>
    </message>
    <message>
        <source>All files</source>
        <translation>Todos los archivos</translation>
    </message>
    <message>
        <source>Every X-ray already has an initial camera.</source>
        <translation>Todas las radiografías tienen ya una cámara inicial.</translation>
    </message>
    <message>
        <source>{count} found.</source>
        <translation>Encontradas: {count}.</translation>
    </message>
    <message>
        <source>X-rays that you changed meanwhile were left as they are.</source>
        <translation>Las radiografías que usted cambió entretanto quedaron como estaban.</translation>
    </message>
    <message>
        <source>Preparing the data...</source>
        <translation>Preparando los datos...</translation>
    </message>
    <message>
        <source>Select an X-ray in the table.</source>
        <translation>Seleccione una radiografía en la tabla.</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Cancelando...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Cancelar</translation>
    </message>
    <message>
        <source>Stop the search; nothing is changed.</source>
        <translation>Detener la búsqueda; no se cambia nada.</translation>
    </message>
    <message>
        <source>This camera source needs no search.</source>
        <translation>Esta fuente de cámara no necesita búsqueda.</translation>
    </message>
    <message>
        <source>Choose the model file.</source>
        <translation>Elija el archivo del modelo.</translation>
    </message>
    <message>
        <source>Find the camera of the selected X-ray.</source>
        <translation>Buscar la cámara de la radiografía seleccionada.</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Cancelado; no se cambió nada.</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>Iniciando...</translation>
    </message>
    <message>
        <source>Camera of {name}</source>
        <translation>Cámara de {name}</translation>
    </message>
    <message>
        <source>{count} uncertain and not in use: select the X-ray and review it.</source>
        <translation>Inciertas y sin usar: {count}; seleccione la radiografía y revise su cámara.</translation>
    </message>
    <message>
        <source>{stage}: {iteration} of {of}</source>
        <translation>{stage}: {iteration} de {of}</translation>
    </message>
</context>
<context>
    <name>panel.carm</name>
    <message>
        <source>Preparing the CT...</source>
        <translation>Preparando la TC...</translation>
    </message>
    <message>
        <source>The registration of &apos;{name}&apos; will start from this camera.</source>
        <translation>El registro de «{name}» partirá de esta cámara.</translation>
    </message>
    <message>
        <source>Choose the CT first.</source>
        <translation>Elija primero la TC.</translation>
    </message>
    <message>
        <source>Select an X-ray that is ready.</source>
        <translation>Seleccione una radiografía que esté lista.</translation>
    </message>
    <message>
        <source>Live ({milliseconds:.0f} ms per image).</source>
        <translation>En vivo ({milliseconds:.0f} ms por imagen).</translation>
    </message>
    <message>
        <source>Initial camera of {name}</source>
        <translation>Cámara inicial de {name}</translation>
    </message>
</context>
<context>
    <name>panel.carry</name>
    <message>
        <source>Is put under the result&apos;s transform while After is shown, and back for Before.</source>
        <translation>Se pone bajo la transformación del resultado mientras se muestra Después, y vuelve a su sitio con Antes.</translation>
    </message>
    <message>
        <source>Computing...</source>
        <translation>Calculando...</translation>
    </message>
    <message>
        <source>Points inside a bone take the bone&apos;s own motion; all others, the displacement field. The markups themselves stay as they are: copies of them are shown.</source>
        <translation>Los puntos dentro de un hueso siguen el movimiento de ese hueso; los demás, el campo de desplazamientos. Las marcas mismas no cambian: se muestran copias.</translation>
    </message>
    <message>
        <source>Nothing to carry: load or make markups, models, segmentations or volumes of the CT.</source>
        <translation>No hay nada que llevar: cargue o cree marcas, modelos, segmentaciones o volúmenes de la TC.</translation>
    </message>
    <message>
        <source>Points follow the displacement field alone: {reason}</source>
        <translation>Los puntos siguen solo el campo de desplazamientos: {reason}</translation>
    </message>
    <message>
        <source>Check what shall follow Before and After.</source>
        <translation>Marque lo que debe seguir a Antes y Después.</translation>
    </message>
    <message>
        <source>Choose After in the tab Compare to see it in the posture of the X-rays.</source>
        <translation>Elija Después en la pestaña Comparar para verlo en la postura de las radiografías.</translation>
    </message>
    <message>
        <source>Shown in the posture of the X-rays.</source>
        <translation>Se muestra en la postura de las radiografías.</translation>
    </message>
</context>
<context>
    <name>panel.export</name>
    <message>
        <source>Added to Slicer&apos;s DICOM database.</source>
        <translation>Añadido a la base de datos DICOM de Slicer.</translation>
    </message>
    <message>
        <source>Writing DICOM...</source>
        <translation>Escribiendo DICOM...</translation>
    </message>
    <message>
        <source>Export as DICOM...</source>
        <translation>Exportar como DICOM...</translation>
    </message>
    <message>
        <source>Export as DICOM into a folder</source>
        <translation>Exportar como DICOM a una carpeta</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Cancelar</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Cancelado; no se cambió nada.</translation>
    </message>
    <message>
        <source>Add the exported DICOM objects to Slicer&apos;s DICOM database?</source>
        <translation>¿Añadir los objetos DICOM exportados a la base de datos DICOM de Slicer?</translation>
    </message>
    <message>
        <source>Stop the export; nothing is written.</source>
        <translation>Detener la exportación; no se escribe nada.</translation>
    </message>
    <message>
        <source>Write the warped CT, the segmentation, every bone&apos;s motion and the deformation as DICOM objects, for planning systems.</source>
        <translation>Escribir la TC deformada, la segmentación, el movimiento de cada hueso y la deformación como objetos DICOM, para sistemas de planificación.</translation>
    </message>
    <message>
        <source>Written to {folder}.</source>
        <translation>Escrito en {folder}.</translation>
    </message>
    <message>
        <source>Export as DICOM</source>
        <translation>Exportar como DICOM</translation>
    </message>
    <message>
        <source>Slicer&apos;s DICOM module could not add them ({reason}): add the folder there.</source>
        <translation>El módulo DICOM de Slicer no pudo añadirlos ({reason}): añada allí la carpeta.</translation>
    </message>
    <message>
        <source>The CT is not in Slicer&apos;s DICOM database: everything, the CT too, was written for the placeholder patient {name}.</source>
        <translation>La TC no está en la base de datos DICOM de Slicer: todo, también la TC, se escribió para el paciente ficticio {name}.</translation>
    </message>
</context>
<context>
    <name>panel.landmark_table</name>
    <message>
        <source>Landmark</source>
        <translation>Punto de referencia</translation>
    </message>
    <message>
        <source>Error [mm]</source>
        <translation>Error [mm]</translation>
    </message>
    <message>
        <source>Error [px]</source>
        <translation>Error [px]</translation>
    </message>
    <message>
        <source>State</source>
        <translation>Estado</translation>
    </message>
    <message>
        <source>only in the CT</source>
        <translation>solo en la TC</translation>
    </message>
    <message>
        <source>only in the X-ray</source>
        <translation>solo en la radiografía</translation>
    </message>
    <message>
        <source>not on the X-ray</source>
        <translation>fuera de la radiografía</translation>
    </message>
    <message>
        <source>pending</source>
        <translation>pendiente</translation>
    </message>
    <message>
        <source>used</source>
        <translation>usado</translation>
    </message>
    <message>
        <source>excluded: inconsistent with the others</source>
        <translation>excluido: incoherente con los demás</translation>
    </message>
</context>
<context>
    <name>panel.landmarks</name>
    <message>
        <source>Slicer has no main window to show the views in.</source>
        <translation>Slicer no tiene ventana principal en la que mostrar las vistas.</translation>
    </message>
    <message>
        <source>{name}: landmarks in the CT</source>
        <translation>{name}: puntos de referencia en la TC</translation>
    </message>
    <message>
        <source>{name}: landmarks in the X-ray</source>
        <translation>{name}: puntos de referencia en la radiografía</translation>
    </message>
    <message>
        <source>projected landmarks</source>
        <translation>puntos de referencia proyectados</translation>
    </message>
    <message>
        <source>Camera of {name} by landmarks</source>
        <translation>Cámara de {name} por puntos de referencia</translation>
    </message>
    <message>
        <source>Only the first {count} X-rays can be shown: remove another one first.</source>
        <translation>Solo pueden mostrarse las primeras {count} radiografías: quite antes otra.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is already used by another X-ray or by the CT: each X-ray needs a list of its own.</source>
        <translation>«{name}» ya la usa otra radiografía o la TC: cada radiografía necesita su propia lista.</translation>
    </message>
    <message>
        <source>{name}: pixels</source>
        <translation>{name}: píxeles</translation>
    </message>
</context>
<context>
    <name>panel.maps</name>
    <message>
        <source>Computing...</source>
        <translation>Calculando...</translation>
    </message>
    <message>
        <source>nothing</source>
        <translation>nada</translation>
    </message>
    <message>
        <source>Black: &apos;{name}&apos; has no influence; yellow: only &apos;{name}&apos; has.</source>
        <translation>Negro: «{name}» no influye; amarillo: solo influye «{name}».</translation>
    </message>
</context>
<context>
    <name>panel.motions</name>
    <message>
        <source>Displacement [mm]</source>
        <translation>Desplazamiento [mm]</translation>
    </message>
    <message>
        <source>Rotation [deg]</source>
        <translation>Rotación [deg]</translation>
    </message>
    <message>
        <source>Right [mm]</source>
        <translation>Derecha [mm]</translation>
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
        <translation>Eje (R, A, S)</translation>
    </message>
    <message>
        <source>Uncertainty</source>
        <translation>Incertidumbre</translation>
    </message>
    <message>
        <source>Doubts</source>
        <translation>Dudas</translation>
    </message>
    <message>
        <source>Structure</source>
        <translation>Estructura</translation>
    </message>
    <message>
        <source>Save motions</source>
        <translation>Guardar los movimientos</translation>
    </message>
    <message>
        <source>Tables (*.csv)</source>
        <translation>Tablas (*.csv)</translation>
    </message>
    <message>
        <source>the CT (absolute)</source>
        <translation>la TC (absoluto)</translation>
    </message>
    <message>
        <source>Relative to {name}</source>
        <translation>Respecto a {name}</translation>
    </message>
    <message>
        <source>{path} cannot be written ({reason}): choose another folder.</source>
        <translation>No se puede escribir {path} ({reason}): elija otra carpeta.</translation>
    </message>
</context>
<context>
    <name>panel.register</name>
    <message>
        <source>Register</source>
        <translation>Registrar</translation>
    </message>
    <message>
        <source>Preparing the data...</source>
        <translation>Preparando los datos...</translation>
    </message>
    <message>
        <source>Reading the result...</source>
        <translation>Leyendo el resultado...</translation>
    </message>
    <message>
        <source>Done in {seconds:.0f} s on {device}.</source>
        <translation>Terminado en {seconds:.0f} s en {device}.</translation>
    </message>
    <message>
        <source>PolyPose similarity</source>
        <translation>PolyPose similitud</translation>
    </message>
    <message>
        <source>PolyPose similarity curve</source>
        <translation>PolyPose curva de similitud</translation>
    </message>
    <message>
        <source>PolyPose similarity plot</source>
        <translation>PolyPose gráfica de similitud</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Cancelando...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Cancelar</translation>
    </message>
    <message>
        <source>Stop the registration; nothing is changed.</source>
        <translation>Detener el registro; no se cambia nada.</translation>
    </message>
    <message>
        <source>Align the CT to the X-rays.</source>
        <translation>Alinear la TC con las radiografías.</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Cancelado; no se cambió nada.</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>Iniciando...</translation>
    </message>
    <message>
        <source>this computer</source>
        <translation>este ordenador</translation>
    </message>
    <message>
        <source>Ready: {bones} structures, {xrays} X-rays.</source>
        <translation>Listo: {bones} estructuras, {xrays} radiografías.</translation>
    </message>
</context>
<context>
    <name>panel.report_page</name>
    <message>
        <source>PolyPose report</source>
        <translation>Informe de PolyPose</translation>
    </message>
    <message>
        <source>Research software, not for clinical decisions.</source>
        <translation>Software de investigación, no apto para decisiones clínicas.</translation>
    </message>
    <message>
        <source>Do not trust this result: {why}</source>
        <translation>No se fíe de este resultado: {why}</translation>
    </message>
    <message>
        <source>X-rays and renderings</source>
        <translation>Radiografías y renderizados</translation>
    </message>
    <message>
        <source>Summary</source>
        <translation>Resumen</translation>
    </message>
    <message>
        <source>Motions of the bones</source>
        <translation>Movimientos de los huesos</translation>
    </message>
</context>
<context>
    <name>panel.review</name>
    <message>
        <source>No result yet: register, or load an earlier result.</source>
        <translation>Aún no hay resultado: haga un registro, o cargue un resultado anterior.</translation>
    </message>
    <message>
        <source>all</source>
        <translation>todas</translation>
    </message>
    <message>
        <source>Slicer has no main window to show the views in.</source>
        <translation>Slicer no tiene ventana principal en la que mostrar las vistas.</translation>
    </message>
    <message>
        <source>Load a result folder</source>
        <translation>Cargar una carpeta de resultado</translation>
    </message>
</context>
<context>
    <name>panel.saving</name>
    <message>
        <source>Save report</source>
        <translation>Guardar el informe</translation>
    </message>
    <message>
        <source>HTML pages (*.html)</source>
        <translation>Páginas HTML (*.html)</translation>
    </message>
    <message>
        <source>Save result as a scene</source>
        <translation>Guardar el resultado como escena</translation>
    </message>
    <message>
        <source>Scenes (*.mrb)</source>
        <translation>Escenas (*.mrb)</translation>
    </message>
    <message>
        <source>{voxels} voxels of {spacing} mm</source>
        <translation>{voxels} vóxeles de {spacing} mm</translation>
    </message>
    <message>
        <source>CT</source>
        <translation>TC</translation>
    </message>
    <message>
        <source>Structures</source>
        <translation>Estructuras</translation>
    </message>
    <message>
        <source>Anchor</source>
        <translation>Ancla</translation>
    </message>
    <message>
        <source>Preset</source>
        <translation>Preajuste</translation>
    </message>
    <message>
        <source>Computed on</source>
        <translation>Calculado en</translation>
    </message>
    <message>
        <source>Computing time [s]</source>
        <translation>Tiempo de cálculo [s]</translation>
    </message>
    <message>
        <source>X-ray</source>
        <translation>Radiografía</translation>
    </message>
    <message>
        <source>rendering</source>
        <translation>renderizado</translation>
    </message>
    <message>
        <source>edges</source>
        <translation>bordes</translation>
    </message>
    <message>
        <source>{path} cannot be written ({reason}): choose another folder.</source>
        <translation>No se puede escribir {path} ({reason}): elija otra carpeta.</translation>
    </message>
    <message>
        <source>similarity {n:.4f}</source>
        <translation>similitud {n:.4f}</translation>
    </message>
</context>
<context>
    <name>panel.segment_bones</name>
    <message>
        <source>starting</source>
        <translation>iniciando</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Cancelando...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Cancelar</translation>
    </message>
    <message>
        <source>Stop the segmentation; nothing is changed.</source>
        <translation>Detener la segmentación; no se cambia nada.</translation>
    </message>
    <message>
        <source>{name} could not segment the CT ({reason}): see the application&apos;s log.</source>
        <translation>{name} no pudo segmentar la TC ({reason}): consulte el registro de la aplicación.</translation>
    </message>
    <message>
        <source>Segment bones</source>
        <translation>Segmentar</translation>
    </message>
    <message>
        <source>{name} ended with the code {code}: see the application&apos;s log.</source>
        <translation>{name} terminó con el código {code}: consulte el registro de la aplicación.</translation>
    </message>
    <message>
        <source>{name} is installing what it needs...</source>
        <translation>{name} está instalando lo que necesita...</translation>
    </message>
    <message>
        <source>The CT was deleted meanwhile: choose another.</source>
        <translation>La TC se eliminó entretanto: elija otra.</translation>
    </message>
    <message>
        <source>{ct} bones</source>
        <translation>{ct} huesos</translation>
    </message>
    <message>
        <source>Segmented with {name}: check the bones and their structures.</source>
        <translation>Segmentado con {name}: compruebe los huesos y sus estructuras.</translation>
    </message>
    <message>
        <source>Segment the CT with the extension TotalSegmentator or MONAIAuto3DSeg, and propose the structures.</source>
        <translation>Segmentar la TC con la extensión TotalSegmentator o MONAIAuto3DSeg y proponer las estructuras.</translation>
    </message>
    <message>
        <source>Choose the CT first.</source>
        <translation>Elija primero la TC.</translation>
    </message>
    <message>
        <source>{name} found nothing in &apos;{ct}&apos;: is it a CT in Hounsfield units?</source>
        <translation>{name} no encontró nada en «{ct}»: ¿es una TC en unidades Hounsfield?</translation>
    </message>
    <message>
        <source>&apos;{node}&apos; is ready; another CT is chosen by now.</source>
        <translation>«{node}» está listo; entretanto se ha elegido otra TC.</translation>
    </message>
    <message>
        <source>{name}: {line}</source>
        <translation>{name}: {line}</translation>
    </message>
    <message>
        <source>The extension cannot be loaded ({reason}): update it.</source>
        <translation>La extensión no se puede cargar ({reason}): actualícela.</translation>
    </message>
</context>
<context>
    <name>panel.stage_words</name>
    <message>
        <source>Saving the result...</source>
        <translation>Guardando el resultado...</translation>
    </message>
    <message>
        <source>Saving the track...</source>
        <translation>Guardando el seguimiento...</translation>
    </message>
    <message>
        <source>Tracking: {frame} of {of} frames</source>
        <translation>Seguimiento: {frame} de {of} instantes</translation>
    </message>
    <message>
        <source>Back: {frame} of {of} frames</source>
        <translation>Regreso: {frame} de {of} instantes</translation>
    </message>
    <message>
        <source>Preparing the CT</source>
        <translation>Preparando la TC</translation>
    </message>
    <message>
        <source>Fitting the bones</source>
        <translation>Ajustando los huesos</translation>
    </message>
    <message>
        <source>Looking for better places of bones</source>
        <translation>Buscando mejores posiciones de los huesos</translation>
    </message>
    <message>
        <source>Looking at united bones one by one</source>
        <translation>Examinando uno a uno los huesos unidos</translation>
    </message>
    <message>
        <source>Estimating the uncertainty</source>
        <translation>Estimando la incertidumbre</translation>
    </message>
    <message>
        <source>Warping the CT</source>
        <translation>Deformando la TC</translation>
    </message>
    <message>
        <source>Rendering the X-rays</source>
        <translation>Renderizando las radiografías</translation>
    </message>
    <message>
        <source>{stage}: {iteration} of {of}</source>
        <translation>{stage}: {iteration} de {of}</translation>
    </message>
    <message>
        <source>about {minutes:.0f} min left in this pass</source>
        <translation>quedan unos {minutes:.0f} min de esta pasada</translation>
    </message>
    <message>
        <source>, similarity {similarity:.4f}</source>
        <translation>, similitud {similarity:.4f}</translation>
    </message>
    <message>
        <source>about {seconds:.0f} s left in this pass</source>
        <translation>quedan unos {seconds:.0f} s de esta pasada</translation>
    </message>
    <message>
        <source>Camera of {name}</source>
        <translation>Cámara de {name}</translation>
    </message>
</context>
<context>
    <name>panel.structures</name>
    <message>
        <source>No segment has the name of a bone, such as femur_left or &apos;Left femur&apos;: rename the segments, or type the structures into the table.</source>
        <translation>Ningún segmento tiene el nombre de un hueso, como femur_left o &apos;Left femur&apos;: cambie el nombre de los segmentos, o escriba las estructuras en la tabla.</translation>
    </message>
    <message>
        <source>Choose a CT and its segmentation; every bone needs a segment.</source>
        <translation>Elija una TC y su segmentación; cada hueso necesita un segmento.</translation>
    </message>
    <message>
        <source>No segment is included yet: propose structures, or check segments in the table.</source>
        <translation>Aún no hay ningún segmento incluido: haga proponer las estructuras, o marque segmentos en la tabla.</translation>
    </message>
    <message>
        <source>Segment (moves)</source>
        <translation>Segmento (se mueve)</translation>
    </message>
    <message>
        <source>Structure</source>
        <translation>Estructura</translation>
    </message>
    <message>
        <source>Anchor</source>
        <translation>Ancla</translation>
    </message>
    <message>
        <source>Checked: this segment moves as a bone.</source>
        <translation>Marcado: este segmento se mueve como un hueso.</translation>
    </message>
    <message>
        <source>Moving relative to the anchor, &apos;{anchor}&apos;: {names}.</source>
        <translation>Se mueven respecto al ancla, «{anchor}»: {names}.</translation>
    </message>
    <message>
        <source>anchor</source>
        <translation>ancla</translation>
    </message>
    <message>
        <source>{count} structures; now check the anchor, which stays where it is.</source>
        <translation>{count} estructuras; compruebe ahora el ancla, que permanece en su sitio.</translation>
    </message>
    <message>
        <source>Only the anchor, &apos;{anchor}&apos;, is included: the cameras will be found, and no bone moves.</source>
        <translation>Solo está incluida el ancla, «{anchor}»: se buscarán las cámaras, y ningún hueso se moverá.</translation>
    </message>
</context>
<context>
    <name>panel.track_review</name>
    <message>
        <source>forward and backward</source>
        <translation>adelante y atrás</translation>
    </message>
    <message>
        <source>forward</source>
        <translation>adelante</translation>
    </message>
    <message>
        <source>backward</source>
        <translation>atrás</translation>
    </message>
    <message>
        <source>Saving the track...</source>
        <translation>Guardando el seguimiento...</translation>
    </message>
    <message>
        <source>Save the track into a folder</source>
        <translation>Guardar el seguimiento en una carpeta</translation>
    </message>
    <message>
        <source>A smoothed track cannot be continued: track without smoothing first.</source>
        <translation>Un seguimiento suavizado no se puede continuar: siga primero sin suavizar.</translation>
    </message>
    <message>
        <source>{count} doubtful frames in this direction.</source>
        <translation>{count} instantes dudosos en esta dirección.</translation>
    </message>
    <message>
        <source>The scene has the poses alone: tables and plots of joints are left out.</source>
        <translation>La escena solo tiene las poses: faltan las tablas y gráficas de las articulaciones.</translation>
    </message>
    <message>
        <source>Corrections are not in it before you track on from them.</source>
        <translation>Las correcciones no están incluidas hasta que se siga desde ellas.</translation>
    </message>
    <message>
        <source>Track anew from the bones of this frame, as you have corrected them; other frames are kept.</source>
        <translation>Seguir de nuevo desde los huesos de este instante, tal como se corrigieron; los demás instantes se conservan.</translation>
    </message>
    <message>
        <source>The track could not be written: {reason}</source>
        <translation>No se pudo escribir el seguimiento: {reason}</translation>
    </message>
    <message>
        <source>Written to {folder}.</source>
        <translation>Escrito en {folder}.</translation>
    </message>
</context>
<context>
    <name>panel.track_words</name>
    <message>
        <source>Look at the outlines on the X-rays all the same.</source>
        <translation>Mire de todos modos los contornos sobre las radiografías.</translation>
    </message>
    <message>
        <source>What to do: correct a doubtful frame and track on from there, or give better cameras.</source>
        <translation>Qué hacer: corregir un instante dudoso y seguir desde ahí, o dar mejores cámaras.</translation>
    </message>
    <message>
        <source>The checks found no sign of failure</source>
        <translation>Las comprobaciones no encontraron ningún indicio de fallo</translation>
    </message>
    <message>
        <source>{frames} frames are tracked, in {seconds:.0f} s.</source>
        <translation>{frames} instantes seguidos, en {seconds:.0f} s.</translation>
    </message>
    <message>
        <source>DO NOT TRUST THIS TRACK</source>
        <translation>NO CONFÍE EN ESTE SEGUIMIENTO</translation>
    </message>
    <message>
        <source>Check the doubtful frames before you use the track</source>
        <translation>Compruebe los instantes dudosos antes de usar el seguimiento</translation>
    </message>
    <message>
        <source>{name}: {count} images; frame 0 is image {first}.</source>
        <translation>{name}: {count} imágenes; al instante 0 corresponde la imagen {first}.</translation>
    </message>
    <message>
        <source>{name}: {doubtful} doubtful frames, lost in {lost} of them.</source>
        <translation>{name}: {doubtful} instantes dudosos, perdido en {lost} de ellos.</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>Advertencia: {text}</translation>
    </message>
    <message>
        <source>Frame {number}</source>
        <translation>Instante {number}</translation>
    </message>
    <message>
        <source>Why: {why}</source>
        <translation>Motivo: {why}</translation>
    </message>
    <message>
        <source>Corrected by hand: {names}.</source>
        <translation>Corregido a mano: {names}.</translation>
    </message>
    <message>
        <source>{name} was lost.</source>
        <translation>{name} se perdió.</translation>
    </message>
    <message>
        <source>{name} is doubtful: {why}.</source>
        <translation>{name} es dudoso: {why}.</translation>
    </message>
</context>
<context>
    <name>panel.tracking</name>
    <message>
        <source>Preparing the data...</source>
        <translation>Preparando los datos...</translation>
    </message>
    <message>
        <source>Track</source>
        <translation>Seguir</translation>
    </message>
    <message>
        <source>Reading the track...</source>
        <translation>Leyendo el seguimiento...</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>Cancelando...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Cancelar</translation>
    </message>
    <message>
        <source>Stop the tracking; frames that are done are kept.</source>
        <translation>Detener el seguimiento; los instantes terminados se conservan.</translation>
    </message>
    <message>
        <source>Follow the bones through the sequences.</source>
        <translation>Seguir los huesos a través de las secuencias.</translation>
    </message>
    <message>
        <source>{count} frames of an interrupted tracking are kept: Go on continues after them.

Begin anew all the same? They are removed once the new tracking has frames of its own.</source>
        <translation>Se conservan {count} instantes de un seguimiento interrumpido: Continuar sigue después de ellos.

¿Empezar de nuevo de todos modos? Se eliminarán en cuanto el nuevo seguimiento tenga instantes propios.</translation>
    </message>
    <message>
        <source>Cancelled.</source>
        <translation>Cancelado.</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Cancelado; no se cambió nada.</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>Iniciando...</translation>
    </message>
    <message>
        <source>The finished track is in {folder} until the scene is closed.</source>
        <translation>El seguimiento terminado está en {folder} hasta que se cierre la escena.</translation>
    </message>
    <message>
        <source>{count} frames are kept: press Go on to continue after them, as long as the inputs stay as they are.</source>
        <translation>Se conservan {count} instantes: Continuar sigue después de ellos, mientras las entradas no cambien.</translation>
    </message>
    <message>
        <source>Ready: {bones} structures, {cameras} cameras, frames {first} to {last}, {rate:.4g} a second.</source>
        <translation>Listo: {bones} estructuras, {cameras} cámaras, instantes {first} a {last}, {rate:.4g} por segundo.</translation>
    </message>
</context>
<context>
    <name>panel.undo</name>
    <message>
        <source>Redo</source>
        <translation>Rehacer</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Deshacer</translation>
    </message>
    <message>
        <source>Brings back what was there before the last registration.</source>
        <translation>Recupera lo que había antes del último registro.</translation>
    </message>
    <message>
        <source>Bring back the result of the last registration.</source>
        <translation>Recuperar el resultado del último registro.</translation>
    </message>
    <message>
        <source>Take the result of the last registration out of the scene; Redo brings it back.</source>
        <translation>Quitar de la escena el resultado del último registro; «Rehacer» lo recupera.</translation>
    </message>
    <message>
        <source>Bring back the result that was there before the last registration.</source>
        <translation>Recuperar el resultado que había antes del último registro.</translation>
    </message>
</context>
<context>
    <name>panel.verdict</name>
    <message>
        <source>Look at the overlay of each X-ray all the same.</source>
        <translation>Mire de todos modos la superposición de cada radiografía.</translation>
    </message>
    <message>
        <source>What to do: look at the overlay of each X-ray; where it does not match, give a better initial camera or landmarks, and register again.</source>
        <translation>Qué hacer: mire la superposición de cada radiografía; donde no coincida, dé una cámara inicial mejor o puntos de referencia, y registre de nuevo.</translation>
    </message>
    <message>
        <source>The checks found no sign of failure</source>
        <translation>Las comprobaciones no encontraron ningún indicio de fallo</translation>
    </message>
    <message>
        <source>DO NOT TRUST THIS RESULT</source>
        <translation>NO SE FÍE DE ESTE RESULTADO</translation>
    </message>
    <message>
        <source>Check what is named here before you use the result</source>
        <translation>Compruebe lo que aquí se indica antes de usar el resultado</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>Advertencia: {text}</translation>
    </message>
    <message>
        <source>Why: {why}</source>
        <translation>Motivo: {why}</translation>
    </message>
</context>
<context>
    <name>panel.xray_details</name>
    <message>
        <source>as in the file</source>
        <translation>como en el archivo</translation>
    </message>
    <message>
        <source>&apos;{text}&apos; is not a number: use digits and a decimal point, or leave the field empty.</source>
        <translation>«{text}» no es un número: use cifras y un punto decimal, o deje el campo vacío.</translation>
    </message>
</context>
<context>
    <name>panel.xray_drop</name>
    <message>
        <source>drop image files, or loaded X-rays (a volume, a sequence, or a folder of them) from a tree of the data</source>
        <translation>suelte archivos de imagen o radiografías cargadas (un volumen, una secuencia o una carpeta de ellas) de un árbol de datos</translation>
    </message>
    <message>
        <source>No X-ray: {names}; {can}.</source>
        <translation>No es una radiografía: {names}; {can}.</translation>
    </message>
    <message>
        <source>Nothing here is an X-ray: {can}.</source>
        <translation>Nada de esto es una radiografía: {can}.</translation>
    </message>
    <message>
        <source>{names} and {count} more</source>
        <translation>{names} y {count} más</translation>
    </message>
</context>
<context>
    <name>panel.xrays</name>
    <message>
        <source>Add two or more X-rays from different directions.</source>
        <translation>Añada dos o más radiografías de direcciones distintas.</translation>
    </message>
    <message>
        <source>X-ray</source>
        <translation>Radiografía</translation>
    </message>
    <message>
        <source>Geometry from</source>
        <translation>Geometría según</translation>
    </message>
    <message>
        <source>Camera</source>
        <translation>Cámara</translation>
    </message>
    <message>
        <source>State</source>
        <translation>Estado</translation>
    </message>
    <message>
        <source>X-rays</source>
        <translation>Radiografías</translation>
    </message>
    <message>
        <source>All files</source>
        <translation>Todos los archivos</translation>
    </message>
    <message>
        <source>Read geometry</source>
        <translation>Leer la geometría</translation>
    </message>
    <message>
        <source>Study files (*.json)</source>
        <translation>Archivos de estudio (*.json)</translation>
    </message>
    <message>
        <source>What was dropped is in the table already.</source>
        <translation>Lo que se soltó ya está en la tabla.</translation>
    </message>
    <message>
        <source>Add X-rays</source>
        <translation>Añadir radiografías</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is not ready: complete its geometry, or remove it.</source>
        <translation>La radiografía «{name}» no está lista: complete su geometría, o quítela.</translation>
    </message>
</context>
<context>
    <name>process.camera_run</name>
    <message>
        <source>search</source>
        <translation>búsqueda</translation>
    </message>
    <message>
        <source>The result of the search cannot be read: search again.</source>
        <translation>No se puede leer el resultado de la búsqueda: busque de nuevo.</translation>
    </message>
</context>
<context>
    <name>process.dependencies</name>
    <message>
        <source>PyTorch is missing, and nothing is installed while testing.</source>
        <translation>Falta PyTorch, y durante las pruebas no se instala nada.</translation>
    </message>
    <message>
        <source>PyTorch was not installed: PolyPose cannot register without it.</source>
        <translation>PyTorch no se instaló: sin él, PolyPose no puede registrar.</translation>
    </message>
    <message>
        <source>PyTorch is missing: install the extension PyTorch in the Extensions Manager and restart Slicer.</source>
        <translation>Falta PyTorch: instale la extensión PyTorch en el gestor de extensiones y reinicie Slicer.</translation>
    </message>
    <message>
        <source>The Python packages that PolyPose needs were not installed ({reason}): try again.</source>
        <translation>Los paquetes de Python que PolyPose necesita no se instalaron ({reason}): inténtelo de nuevo.</translation>
    </message>
    <message>
        <source>PyTorch could not be installed ({reason}): install it in the module PyTorch Utils.</source>
        <translation>No se pudo instalar PyTorch ({reason}): instálelo en el módulo PyTorch Utils.</translation>
    </message>
</context>
<context>
    <name>process.dicom_export</name>
    <message>
        <source>DICOM export</source>
        <translation>exportación DICOM</translation>
    </message>
</context>
<context>
    <name>process.environment</name>
    <message>
        <source>PolyPose needs 3D Slicer {needed} or newer, and this is {found}: install the current stable version.</source>
        <translation>PolyPose necesita 3D Slicer {needed} o posterior, y este es {found}: instale la versión estable actual.</translation>
    </message>
</context>
<context>
    <name>process.extensions</name>
    <message>
        <source>Bones are segmented by the extension TotalSegmentator or MONAIAuto3DSeg: install one in the Extensions Manager and restart Slicer.</source>
        <translation>Los huesos los segmenta la extensión TotalSegmentator o MONAIAuto3DSeg: instale una en el Extensions Manager y reinicie Slicer.</translation>
    </message>
    <message>
        <source>Bones are segmented by an extension, and neither TotalSegmentator nor MONAIAuto3DSeg is installed.

Install {name} now, with the extensions that it needs? It is downloaded from Slicer&apos;s extensions server.</source>
        <translation>Los huesos los segmenta una extensión, y ni TotalSegmentator ni MONAIAuto3DSeg está instalada.

¿Instalar {name} ahora, con las extensiones que necesita? Se descarga del servidor de extensiones de Slicer.</translation>
    </message>
    <message>
        <source>{name} was installed: save your data and restart Slicer.</source>
        <translation>{name} se ha instalado: guarde sus datos y reinicie Slicer.</translation>
    </message>
    <message>
        <source>The extension {name} is installed, but its module is not loaded: restart Slicer, or enable it in the Extensions Manager.</source>
        <translation>La extensión {name} está instalada, pero su módulo no está cargado: reinicie Slicer o actívela en el Extensions Manager.</translation>
    </message>
    <message>
        <source>The extension {name} could not be installed: check the network connection, or install it in the Extensions Manager.</source>
        <translation>La extensión {name} no se pudo instalar: compruebe la conexión de red o instálela en el Extensions Manager.</translation>
    </message>
    <message>
        <source>{name} was installed. Slicer must be restarted before it can be used; data that were not saved are lost. Restart now?</source>
        <translation>{name} se ha instalado. Hay que reiniciar Slicer antes de usarlo; los datos no guardados se pierden. ¿Reiniciar ahora?</translation>
    </message>
</context>
<context>
    <name>process.monai_auto3dseg</name>
    <message>
        <source>MONAIAuto3DSeg offers no model of bones: update the extension.</source>
        <translation>MONAIAuto3DSeg no ofrece ningún modelo de huesos: actualice la extensión.</translation>
    </message>
    <message>
        <source>computing</source>
        <translation>calculando</translation>
    </message>
    <message>
        <source>MONAIAuto3DSeg ended with the code {code}: see the application&apos;s log.</source>
        <translation>MONAIAuto3DSeg terminó con el código {code}: consulte el registro de la aplicación.</translation>
    </message>
    <message>
        <source>MONAIAuto3DSeg&apos;s result could not be read: see the application&apos;s log.</source>
        <translation>El resultado de MONAIAuto3DSeg no se pudo leer: consulte el registro de la aplicación.</translation>
    </message>
    <message>
        <source>reading the result</source>
        <translation>leyendo el resultado</translation>
    </message>
</context>
<context>
    <name>process.registration</name>
    <message>
        <source>registration</source>
        <translation>registro</translation>
    </message>
    <message>
        <source>The result must not be trusted: {reasons}.</source>
        <translation>El resultado no es fiable: {reasons}.</translation>
    </message>
    <message>
        <source>{name} transform</source>
        <translation>{name}: transformación</translation>
    </message>
</context>
<context>
    <name>process.render_client</name>
    <message>
        <source>The CT cannot be rendered ({reason}): choose the CT again to retry.</source>
        <translation>No se puede renderizar la TC ({reason}): elija de nuevo la TC para reintentarlo.</translation>
    </message>
    <message>
        <source>its process ended</source>
        <translation>su proceso terminó</translation>
    </message>
    <message>
        <source>The rendering cannot be read: {reason}.</source>
        <translation>No se puede leer el renderizado: {reason}.</translation>
    </message>
</context>
<context>
    <name>process.segmentation_task</name>
    <message>
        <source>The segmentation was cancelled; nothing was changed.</source>
        <translation>La segmentación se canceló; no se cambió nada.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; was deleted while the CT was segmented: start the segmentation again.</source>
        <translation>«{name}» se eliminó mientras se segmentaba la TC: inicie de nuevo la segmentación.</translation>
    </message>
</context>
<context>
    <name>process.study_run</name>
    <message>
        <source>registration</source>
        <translation>registro</translation>
    </message>
    <message>
        <source>a crash</source>
        <translation>un bloqueo</translation>
    </message>
    <message>
        <source>Memory ran out: crop the CT or use a coarser one.</source>
        <translation>Memoria insuficiente: recorte la TC o use una más gruesa.</translation>
    </message>
    <message>
        <source>The {what} ended without a result (exit status {status}).</source>
        <translation>La operación «{what}» terminó sin resultado (código de salida {status}).</translation>
    </message>
    <message>
        <source>signal {number}</source>
        <translation>señal {number}</translation>
    </message>
    <message>
        <source>The {what} was cancelled.</source>
        <translation>La operación «{what}» se canceló.</translation>
    </message>
    <message>
        <source>The {what} was interrupted from outside.</source>
        <translation>La operación «{what}» fue interrumpida desde fuera.</translation>
    </message>
    <message>
        <source>The {what}&apos;s process was ended by the system ({end}), most often because memory ran out: use the fast preset, or crop the CT.</source>
        <translation>El sistema terminó el proceso de la operación «{what}» ({end}), casi siempre por falta de memoria: use el preajuste rápido, o recorte la TC.</translation>
    </message>
    <message>
        <source>The Python package &apos;{name}&apos; is missing: let PolyPose install what it needs.</source>
        <translation>Falta el paquete de Python «{name}»: deje que PolyPose instale lo que necesita.</translation>
    </message>
    <message>
        <source>The {what} rejected its input without giving a reason.</source>
        <translation>La operación «{what}» rechazó sus datos de entrada sin indicar el motivo.</translation>
    </message>
    <message>
        <source>{program} could not be started ({reason}): install Slicer again.</source>
        <translation>No se pudo iniciar {program} ({reason}): instale Slicer de nuevo.</translation>
    </message>
    <message>
        <source>An unexpected error occurred: {fault}.</source>
        <translation>Se produjo un error inesperado: {fault}.</translation>
    </message>
</context>
<context>
    <name>process.track_run</name>
    <message>
        <source>tracking</source>
        <translation>seguimiento</translation>
    </message>
    <message>
        <source>The track must not be trusted: {reasons}.</source>
        <translation>El seguimiento no es fiable: {reasons}.</translation>
    </message>
</context>
<context>
    <name>scene.bone_handles</name>
    <message>
        <source>Adjustment of {name}</source>
        <translation>Ajuste de {name}</translation>
    </message>
    <message>
        <source>{name}, adjusted</source>
        <translation>{name}, ajustado</translation>
    </message>
    <message>
        <source>Outline of {name}</source>
        <translation>Contorno de {name}</translation>
    </message>
</context>
<context>
    <name>scene.bone_models</name>
    <message>
        <source>Motion of {name}</source>
        <translation>Movimiento de {name}</translation>
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
        <translation>La cámara «{name}» no es una transformación lineal: elija una que lo sea.</translation>
    </message>
</context>
<context>
    <name>scene.carried_nodes</name>
    <message>
        <source>{name} carried along</source>
        <translation>{name} llevado consigo</translation>
    </message>
</context>
<context>
    <name>scene.carried_points</name>
    <message>
        <source>{name} as X-rayed</source>
        <translation>{name} como en las radiografías</translation>
    </message>
</context>
<context>
    <name>scene.deformation</name>
    <message>
        <source>PolyPose volume change</source>
        <translation>PolyPose cambio de volumen</translation>
    </message>
    <message>
        <source>PolyPose volume change colours</source>
        <translation>PolyPose colores del cambio de volumen</translation>
    </message>
    <message>
        <source>PolyPose weight</source>
        <translation>PolyPose peso</translation>
    </message>
    <message>
        <source>PolyPose weight colours</source>
        <translation>PolyPose colores del peso</translation>
    </message>
    <message>
        <source>Volume changes by a factor of {low:.2f} to {high:.2f} (99 % of the grid).</source>
        <translation>El volumen cambia en un factor de {low:.2f} a {high:.2f} (99 % de la cuadrícula).</translation>
    </message>
    <message>
        <source>The deformation folds in {share:.2f} % of the grid (magenta): do not trust the soft tissue there.</source>
        <translation>La deformación se pliega en el {share:.2f} % de la cuadrícula (magenta): no se fíe allí de los tejidos blandos.</translation>
    </message>
    <message>
        <source>PolyPose weight of {name}</source>
        <translation>PolyPose peso de {name}</translation>
    </message>
    <message>
        <source>No folds.</source>
        <translation>Sin pliegues.</translation>
    </message>
    <message>
        <source>There is no structure &apos;{name}&apos;: choose one from the table.</source>
        <translation>No hay ninguna estructura «{name}»: elija una de la tabla.</translation>
    </message>
</context>
<context>
    <name>scene.ellipsoids</name>
    <message>
        <source>95 % ellipsoids of carried points</source>
        <translation>Elipsoides del 95 % de los puntos llevados</translation>
    </message>
</context>
<context>
    <name>scene.grid_transform</name>
    <message>
        <source>&apos;{node}&apos; does not hold a displacement grid: register first, or load a result.</source>
        <translation>«{node}» no contiene una cuadrícula de desplazamientos: haga antes un registro, o cargue un resultado.</translation>
    </message>
</context>
<context>
    <name>scene.motions</name>
    <message>
        <source>Structure</source>
        <translation>Estructura</translation>
    </message>
    <message>
        <source>Rotation [deg]</source>
        <translation>Rotación [deg]</translation>
    </message>
    <message>
        <source>Displacement [mm]</source>
        <translation>Desplazamiento [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % along the beam [mm]</source>
        <translation>{percent:.0f} % a lo largo del haz [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % across the beam [mm]</source>
        <translation>{percent:.0f} % a través del haz [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % about the beam [deg]</source>
        <translation>{percent:.0f} % en torno al haz [deg]</translation>
    </message>
    <message>
        <source>{percent:.0f} % across the beam [deg]</source>
        <translation>{percent:.0f} % a través del haz [deg]</translation>
    </message>
    <message>
        <source>Right [mm]</source>
        <translation>Derecha [mm]</translation>
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
        <translation>Eje R</translation>
    </message>
    <message>
        <source>Axis A</source>
        <translation>Eje A</translation>
    </message>
    <message>
        <source>Axis S</source>
        <translation>Eje S</translation>
    </message>
    <message>
        <source>Doubts</source>
        <translation>Dudas</translation>
    </message>
</context>
<context>
    <name>scene.nodes</name>
    <message>
        <source>The volume &apos;{name}&apos; has no voxels: load it again.</source>
        <translation>El volumen «{name}» no tiene vóxeles: cárguelo de nuevo.</translation>
    </message>
    <message>
        <source>The segmentation &apos;{name}&apos; has no segment &apos;{segment}&apos;.</source>
        <translation>La segmentación «{name}» no tiene el segmento «{segment}».</translation>
    </message>
    <message>
        <source>The segmentation &apos;{name}&apos; cannot be converted to label maps.</source>
        <translation>La segmentación «{name}» no puede convertirse en mapas de etiquetas.</translation>
    </message>
</context>
<context>
    <name>scene.track_charts</name>
    <message>
        <source>angle [deg]</source>
        <translation>ángulo [deg]</translation>
    </message>
    <message>
        <source>translation [mm]</source>
        <translation>traslación [mm]</translation>
    </message>
    <message>
        <source>time [s]</source>
        <translation>tiempo [s]</translation>
    </message>
    <message>
        <source>{joint} angles</source>
        <translation>{joint}: ángulos</translation>
    </message>
    <message>
        <source>{joint} angles, doubtful</source>
        <translation>{joint}: ángulos, dudosos</translation>
    </message>
    <message>
        <source>{joint} angles, this frame</source>
        <translation>{joint}: ángulos, este fotograma</translation>
    </message>
    <message>
        <source>{joint} translations</source>
        <translation>{joint}: traslaciones</translation>
    </message>
    <message>
        <source>{joint} translations, doubtful</source>
        <translation>{joint}: traslaciones, dudosas</translation>
    </message>
    <message>
        <source>{joint} translations, this frame</source>
        <translation>{joint}: traslaciones, este fotograma</translation>
    </message>
    <message>
        <source>{title}, values</source>
        <translation>{title}, valores</translation>
    </message>
    <message>
        <source>{title}, intervals</source>
        <translation>{title}, intervalos</translation>
    </message>
    <message>
        <source>{quantity}, 95 %</source>
        <translation>{quantity}, 95 %</translation>
    </message>
    <message>
        <source>{title}, cursor</source>
        <translation>{title}, cursor</translation>
    </message>
    <message>
        <source>{title}, doubtful frames</source>
        <translation>{title}, fotogramas dudosos</translation>
    </message>
</context>
<context>
    <name>scene.track_outlines</name>
    <message>
        <source>Outline of {bone} on {xray}</source>
        <translation>Contorno de {bone} en {xray}</translation>
    </message>
</context>
<context>
    <name>scene.track_sequences</name>
    <message>
        <source>&apos;{name}&apos; holds no images: choose a sequence of X-rays, or a volume.</source>
        <translation>«{name}» no contiene imágenes: elija una secuencia de radiografías o un volumen.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is not an image: choose a volume or a sequence of volumes.</source>
        <translation>«{name}» no es una imagen: elija un volumen o una secuencia de volúmenes.</translation>
    </message>
</context>
<context>
    <name>scene.xray_views</name>
    <message>
        <source>View of {name}</source>
        <translation>Vista de {name}</translation>
    </message>
    <message>
        <source>C-arm of {name}</source>
        <translation>Arco en C de {name}</translation>
    </message>
    <message>
        <source>Detector of {name}</source>
        <translation>Detector de {name}</translation>
    </message>
</context>
<context>
    <name>study.camera_source</name>
    <message>
        <source>automatic: the best available</source>
        <translation>automática: la mejor disponible</translation>
    </message>
    <message>
        <source>C-arm placed by hand</source>
        <translation>arco en C colocado a mano</translation>
    </message>
    <message>
        <source>DICOM angles</source>
        <translation>ángulos DICOM</translation>
    </message>
    <message>
        <source>landmarks</source>
        <translation>puntos de referencia</translation>
    </message>
    <message>
        <source>search</source>
        <translation>búsqueda</translation>
    </message>
    <message>
        <source>model trained on this CT</source>
        <translation>modelo entrenado con esta TC</translation>
    </message>
    <message>
        <source>calibrated camera</source>
        <translation>cámara calibrada</translation>
    </message>
</context>
<context>
    <name>study.carried_points</name>
    <message>
        <source>Points moved by the bone in which they lie: {count}.</source>
        <translation>Puntos movidos por el hueso en el que están: {count}.</translation>
    </message>
    <message>
        <source>Points moved by the displacement field: {count}.</source>
        <translation>Puntos movidos por el campo de desplazamientos: {count}.</translation>
    </message>
    <message>
        <source>Points outside of the result&apos;s grid, which are only roughly right: {count}.</source>
        <translation>Puntos fuera de la cuadrícula del resultado, solo aproximados: {count}.</translation>
    </message>
    <message>
        <source>The longest half axes of the 95 % ellipsoids: {least:.1f} to {most:.1f} mm.</source>
        <translation>Semiejes más largos de los elipsoides del 95 %: de {least:.1f} a {most:.1f} mm.</translation>
    </message>
    <message>
        <source>Points whose uncertainty is not known: {count}.</source>
        <translation>Puntos cuya incertidumbre no se conoce: {count}.</translation>
    </message>
</context>
<context>
    <name>study.field_words</name>
    <message>
        <source>set &quot;{field}&quot; to &quot;{choice}&quot;</source>
        <translation>ponga «{field}» en «{choice}»</translation>
    </message>
    <message>
        <source>Source to detector</source>
        <translation>Fuente a detector</translation>
    </message>
    <message>
        <source>Source to isocentre</source>
        <translation>Fuente a isocentro</translation>
    </message>
    <message>
        <source>Pixel spacing</source>
        <translation>Tamaño de píxel</translation>
    </message>
    <message>
        <source>Principal point</source>
        <translation>Punto principal</translation>
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
        <translation>Isocentro</translation>
    </message>
    <message>
        <source>Patient position</source>
        <translation>Posición del paciente</translation>
    </message>
    <message>
        <source>Search near</source>
        <translation>Buscar cerca de</translation>
    </message>
    <message>
        <source>Camera pose</source>
        <translation>Pose de la cámara</translation>
    </message>
    <message>
        <source>Image seen from</source>
        <translation>Imagen vista desde</translation>
    </message>
    <message>
        <source>the source</source>
        <translation>la fuente</translation>
    </message>
    <message>
        <source>Distortion</source>
        <translation>Distorsión</translation>
    </message>
    <message>
        <source>corrected</source>
        <translation>corregida</translation>
    </message>
</context>
<context>
    <name>study.landmark_fit</name>
    <message>
        <source>The landmarks</source>
        <translation>Los puntos de referencia</translation>
    </message>
    <message>
        <source>Only in the CT: {names}.</source>
        <translation>Solo en la TC: {names}.</translation>
    </message>
    <message>
        <source>Only in the X-ray: {names}.</source>
        <translation>Solo en la radiografía: {names}.</translation>
    </message>
    <message>
        <source>Not on the X-ray: {names}; pick them in the X-ray&apos;s own view.</source>
        <translation>Fuera de la radiografía: {names}; colóquelos en la vista propia de la radiografía.</translation>
    </message>
    <message>
        <source>{used} of {count} landmarks used, RMS error {rms:.1f} mm; expected accuracy of the camera: {degrees:.1f} deg and {mm:.0f} mm.</source>
        <translation>{used} de {count} puntos de referencia usados, error RMS {rms:.1f} mm; exactitud esperada de la cámara: {degrees:.1f}° y {mm:.0f} mm.</translation>
    </message>
    <message>
        <source>Uncertain: {why}.</source>
        <translation>Incierta: {why}.</translation>
    </message>
    <message>
        <source>{count} of at least {fewest} pairs: pick {missing} more, on the anchor.</source>
        <translation>{count} de al menos {fewest} pares: coloque {missing} más, en el ancla.</translation>
    </message>
</context>
<context>
    <name>study.parameters</name>
    <message>
        <source>Choose the CT.</source>
        <translation>Elija la TC.</translation>
    </message>
    <message>
        <source>Choose the segmentation of the CT&apos;s bones.</source>
        <translation>Elija la segmentación de los huesos de la TC.</translation>
    </message>
    <message>
        <source>Assign at least one segment to a structure, or have the structures proposed.</source>
        <translation>Asigne al menos un segmento a una estructura, o haga proponer las estructuras.</translation>
    </message>
    <message>
        <source>Choose the anchor: the structure that stays where it is.</source>
        <translation>Elija el ancla: la estructura que permanece en su sitio.</translation>
    </message>
    <message>
        <source>Add an X-ray; two or more from different directions are better.</source>
        <translation>Añada una radiografía; dos o más de direcciones distintas son mejores.</translation>
    </message>
    <message>
        <source>Default</source>
        <translation>Predeterminado</translation>
    </message>
    <message>
        <source>Fast (for a first look)</source>
        <translation>Rápido (para una primera impresión)</translation>
    </message>
    <message>
        <source>Paper (the published settings)</source>
        <translation>Artículo (los ajustes publicados)</translation>
    </message>
    <message>
        <source>Automatic</source>
        <translation>Automático</translation>
    </message>
    <message>
        <source>Processor (CPU)</source>
        <translation>Procesador (CPU)</translation>
    </message>
    <message>
        <source>Graphics card (GPU, CUDA)</source>
        <translation>Tarjeta gráfica (GPU, CUDA)</translation>
    </message>
    <message>
        <source>The rig &quot;{name}&quot; has only one X-ray: enter it for another X-ray as well, or clear it.</source>
        <translation>El montaje «{name}» tiene una sola radiografía: indíquelo también en otra, o bórrelo.</translation>
    </message>
</context>
<context>
    <name>study.reader</name>
    <message>
        <source>{path}: there is no such file; correct the study.</source>
        <translation>{path}: no existe ese archivo; corrija el estudio.</translation>
    </message>
</context>
<context>
    <name>study.result_scene</name>
    <message>
        <source>{path} cannot be written: choose another folder.</source>
        <translation>No se puede escribir {path}: elija otra carpeta.</translation>
    </message>
</context>
<context>
    <name>study.results</name>
    <message>
        <source>{name} transform</source>
        <translation>{name}: transformación</translation>
    </message>
    <message>
        <source>{name} warped CT</source>
        <translation>{name}: TC deformada</translation>
    </message>
    <message>
        <source>{name} warped segmentation</source>
        <translation>{name}: segmentación deformada</translation>
    </message>
    <message>
        <source>{name} motions</source>
        <translation>{name}: movimientos</translation>
    </message>
    <message>
        <source>{name} similarity</source>
        <translation>{name}: similitud</translation>
    </message>
    <message>
        <source>{name} similarity curve</source>
        <translation>{name}: curva de similitud</translation>
    </message>
    <message>
        <source>{name} similarity plot</source>
        <translation>{name}: gráfica de similitud</translation>
    </message>
    <message>
        <source>Similarity</source>
        <translation>Similitud</translation>
    </message>
    <message>
        <source>Iteration</source>
        <translation>Iteración</translation>
    </message>
    <message>
        <source>Label {number}</source>
        <translation>Etiqueta {number}</translation>
    </message>
    <message>
        <source>view {number}</source>
        <translation>vista {number}</translation>
    </message>
</context>
<context>
    <name>study.scene_result</name>
    <message>
        <source>No result yet: register, or load an earlier result.</source>
        <translation>Aún no hay resultado: haga un registro, o cargue un resultado anterior.</translation>
    </message>
    <message>
        <source>The result has lost its table of motions: register again, or load the result again.</source>
        <translation>El resultado ha perdido su tabla de movimientos: haga de nuevo el registro, o cargue de nuevo el resultado.</translation>
    </message>
    <message>
        <source>Choose the CT of the result.</source>
        <translation>Elija la TC del resultado.</translation>
    </message>
    <message>
        <source>Choose the segmentation of the result&apos;s bones: it says where they are.</source>
        <translation>Elija la segmentación de los huesos del resultado: indica dónde están.</translation>
    </message>
    <message>
        <source>The result has lost its warped CT or segmentation: register again, or load the result again.</source>
        <translation>El resultado ha perdido su TC deformada o su segmentación: haga de nuevo el registro, o cargue de nuevo el resultado.</translation>
    </message>
    <message>
        <source>The result&apos;s structure &apos;{name}&apos; has no segment: assign it in the first section.</source>
        <translation>La estructura «{name}» del resultado no tiene ningún segmento: asígnelo en la primera sección.</translation>
    </message>
</context>
<context>
    <name>study.track_images</name>
    <message>
        <source>{camera} frames</source>
        <translation>{camera}: fotogramas</translation>
    </message>
    <message>
        <source>{camera} X-ray</source>
        <translation>{camera}: radiografía</translation>
    </message>
</context>
<context>
    <name>study.track_plan</name>
    <message>
        <source>The camera of &apos;{name}&apos; is not known: register one frame of all sequences first, whose cameras are then kept, or state that the camera is known exactly.</source>
        <translation>La cámara de &apos;{name}&apos; no se conoce: registre primero un instante de todas las secuencias, cuyas cámaras se conservan después, o indique que la cámara se conoce exactamente.</translation>
    </message>
    <message>
        <source>The images do not state how many frames there are in a second: enter it.</source>
        <translation>Las imágenes no indican cuántas hay por segundo: introdúzcalo.</translation>
    </message>
    <message>
        <source>No frame is left: there are {count}, counted from 0. Check the first and the last frame.</source>
        <translation>No queda ningún instante: hay {count}, contados desde 0. Compruebe el primero y el último.</translation>
    </message>
    <message>
        <source>Choose the bones first</source>
        <translation>Elija primero los huesos</translation>
    </message>
    <message>
        <source>Two X-rays have the name &quot;{name}&quot;: give each camera its own.</source>
        <translation>Dos radiografías se llaman &quot;{name}&quot;: dé a cada cámara un nombre propio.</translation>
    </message>
    <message>
        <source>Find the cameras first</source>
        <translation>Busque primero las cámaras</translation>
    </message>
    <message>
        <source>Enter the frame rate</source>
        <translation>Introduzca la cadencia</translation>
    </message>
    <message>
        <source>No frame is left that every camera has: check which image each X-ray shows (Frame).</source>
        <translation>No queda ningún instante que tengan todas las cámaras: compruebe qué imagen muestra cada radiografía (Imagen).</translation>
    </message>
    <message>
        <source>Check the frames</source>
        <translation>Compruebe los instantes</translation>
    </message>
    <message>
        <source>Register one frame first</source>
        <translation>Registre primero un instante</translation>
    </message>
    <message>
        <source>There is no result to start from: register one frame, or choose another start.</source>
        <translation>No hay resultado desde el que empezar: registre un instante o elija otro inicio.</translation>
    </message>
    <message>
        <source>Choose the CT.</source>
        <translation>Elija la TC.</translation>
    </message>
    <message>
        <source>Choose the segmentation of the CT&apos;s bones.</source>
        <translation>Elija la segmentación de los huesos de la TC.</translation>
    </message>
    <message>
        <source>Assign at least one segment to a structure, or have the structures proposed.</source>
        <translation>Asigne al menos un segmento a una estructura, o haga proponer las estructuras.</translation>
    </message>
    <message>
        <source>Choose the reference: the structure relative to which motions are reported.</source>
        <translation>Elija la referencia: la estructura respecto a la cual se indican los movimientos.</translation>
    </message>
    <message>
        <source>Let a bone move</source>
        <translation>Deje moverse un hueso</translation>
    </message>
    <message>
        <source>Every structure stands still: uncheck those that move in the sequence.</source>
        <translation>Todas las estructuras están inmóviles: desmarque las que se mueven en la secuencia.</translation>
    </message>
    <message>
        <source>Add an X-ray sequence first</source>
        <translation>Añada primero una secuencia</translation>
    </message>
    <message>
        <source>None of the X-rays is a sequence: add one for each camera in the section X-rays.</source>
        <translation>Ninguna de las radiografías es una secuencia: añada una por cámara en la sección Radiografías.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is not ready: complete its geometry, or remove it.</source>
        <translation>La radiografía «{name}» no está lista: complete su geometría, o quítela.</translation>
    </message>
    <message>
        <source>Name the X-rays first</source>
        <translation>Nombre primero las radiografías</translation>
    </message>
    <message>
        <source>One camera shows next to nothing of motion along its rays: two are better.</source>
        <translation>Una sola cámara apenas muestra el movimiento a lo largo de sus rayos: dos son mejor.</translation>
    </message>
    <message>
        <source>Complete the X-rays first</source>
        <translation>Complete las radiografías</translation>
    </message>
    <message>
        <source>The sequences state different numbers of frames per second ({rates}): enter the true one.</source>
        <translation>Las secuencias indican números distintos de imágenes por segundo ({rates}): introduzca el verdadero.</translation>
    </message>
    <message>
        <source>The result&apos;s poses of structures that stand still are flagged as uncertain ({names}), but the track takes them as exact and flags nothing: let them move, or correct them and register again.</source>
        <translation>En el resultado, las poses de estructuras inmóviles están marcadas como inciertas ({names}), pero el seguimiento las toma por exactas y no marca nada: deje que se muevan, o corríjalas y registre de nuevo.</translation>
    </message>
    <message>
        <source>{count} X-rays are single images and are not tracked.</source>
        <translation>{count} radiografías son imágenes sueltas y no se siguen.</translation>
    </message>
    <message>
        <source>The sequences have different numbers of images from frame 0 on ({each}): what one of them lacks is not tracked.</source>
        <translation>Las secuencias tienen números distintos de imágenes desde el instante 0 ({each}): lo que falta en una no se sigue.</translation>
    </message>
    <message>
        <source>The images state {rate:.4g} frames per second, another number than was entered.</source>
        <translation>Las imágenes indican {rate:.4g} por segundo, otro número que el introducido.</translation>
    </message>
    <message>
        <source>{name}: by their times, images are missing after image {number}; frames are taken as evenly spaced.</source>
        <translation>{name}: según sus tiempos, faltan imágenes después de la imagen {number}; se supone que los fotogramas están espaciados uniformemente.</translation>
    </message>
    <message>
        <source>The result&apos;s poses belong to another frame than {frame}, which starts from them nevertheless.</source>
        <translation>Las poses del resultado no son las del instante {frame}, que empieza ahí de todos modos.</translation>
    </message>
</context>
<context>
    <name>study.track_request</name>
    <message>
        <source>where the CT has the bones</source>
        <translation>donde el CT tiene los huesos</translation>
    </message>
    <message>
        <source>registration of the first frame</source>
        <translation>registro del primer instante</translation>
    </message>
    <message>
        <source>poses of the present result</source>
        <translation>poses del resultado actual</translation>
    </message>
</context>
<context>
    <name>study.track_scene</name>
    <message>
        <source>Track</source>
        <translation>Seguimiento</translation>
    </message>
    <message>
        <source>Track, all numbers</source>
        <translation>Seguimiento, todos los números</translation>
    </message>
    <message>
        <source>{bone} poses</source>
        <translation>{bone}: poses</translation>
    </message>
    <message>
        <source>The X-rays &apos;{image}&apos; have {columns} x {rows} pixels, but the track&apos;s camera &apos;{camera}&apos; has {width} x {height}: choose those that were tracked.</source>
        <translation>Las radiografías «{image}» tienen {columns} x {rows} píxeles, pero la cámara «{camera}» del seguimiento tiene {width} x {height}: elija las que se siguieron.</translation>
    </message>
    <message>
        <source>{bone} pose</source>
        <translation>{bone}: pose</translation>
    </message>
    <message>
        <source>{bone} in motion</source>
        <translation>{bone} en movimiento</translation>
    </message>
    <message>
        <source>The track&apos;s structure &apos;{name}&apos; has no segment: assign it in the first section.</source>
        <translation>La estructura «{name}» del seguimiento no tiene segmento: asígnelo en la primera sección.</translation>
    </message>
    <message>
        <source>The segments of &apos;{name}&apos; hold no voxel: draw them.</source>
        <translation>Los segmentos de «{name}» no contienen ningún vóxel: dibújelos.</translation>
    </message>
    <message>
        <source>The segments of &apos;{name}&apos; are not where they were when the track was made: choose its CT and segmentation, and put them where they were.</source>
        <translation>Los segmentos de &apos;{name}&apos; no están donde estaban cuando se hizo el seguimiento: elija su TC y su segmentación, y colóquelas donde estaban.</translation>
    </message>
</context>
<context>
    <name>study.track_settings</name>
    <message>
        <source>The track &apos;{name}&apos; of the scene is damaged: delete it, and track again.</source>
        <translation>El seguimiento &apos;{name}&apos; de la escena está dañado: elimínelo y repita el seguimiento.</translation>
    </message>
</context>
<context>
    <name>study.track_writer</name>
    <message>
        <source>The tracking was cancelled.</source>
        <translation>Se canceló el seguimiento.</translation>
    </message>
</context>
<context>
    <name>study.writer</name>
    <message>
        <source>The segmentation &apos;{segmentation}&apos; has {count} segments named &apos;{name}&apos;: give the ID of one.</source>
        <translation>La segmentación «{segmentation}» tiene {count} segmentos llamados «{name}»: indique el ID de uno.</translation>
    </message>
    <message>
        <source>No CT is chosen: choose a volume.</source>
        <translation>No se ha elegido ninguna TC: elija un volumen.</translation>
    </message>
    <message>
        <source>No segmentation is chosen: choose that of the CT&apos;s bones.</source>
        <translation>No se ha elegido ninguna segmentación: elija la de los huesos de la TC.</translation>
    </message>
    <message>
        <source>No structure is chosen: include at least the anchor and one other bone.</source>
        <translation>No se ha elegido ninguna estructura: incluya al menos el ancla y otro hueso.</translation>
    </message>
    <message>
        <source>There is no X-ray: add at least one; two from different directions are better.</source>
        <translation>No hay ninguna radiografía: añada al menos una; dos de direcciones distintas son mejores.</translation>
    </message>
    <message>
        <source>The segmentation &apos;{segmentation}&apos; has no segment named &apos;{name}&apos;.</source>
        <translation>La segmentación «{segmentation}» no tiene ningún segmento llamado «{name}».</translation>
    </message>
    <message>
        <source>The anchor &apos;{anchor}&apos; is not one of the structures: choose one of them.</source>
        <translation>El ancla «{anchor}» no es una de las estructuras: elija una de ellas.</translation>
    </message>
    <message>
        <source>PolyPose needs about {needed:.1f} GB in {folder}, where {free:.1f} GB are free: free some space, or set another temporary folder in Slicer&apos;s settings.</source>
        <translation>PolyPose necesita unos {needed:.1f} GB en {folder}, donde hay {free:.1f} GB libres: libere espacio o elija otra carpeta temporal en los ajustes de Slicer.</translation>
    </message>
    <message>
        <source>The structure &apos;{structure}&apos; has no voxels of its own inside the CT: leave it out, or correct its segments.</source>
        <translation>La estructura «{structure}» no tiene vóxeles propios dentro de la TC: omítala, o corrija sus segmentos.</translation>
    </message>
    <message>
        <source>{file} could not be written completely into {folder}: free some space there, or set another temporary folder in Slicer&apos;s settings.</source>
        <translation>No se pudo escribir {file} por completo en {folder}: libere espacio allí, o indique otra carpeta temporal en los ajustes de Slicer.</translation>
    </message>
    <message>
        <source>Segment &apos;{segment}&apos; shares {percent:.0f} % of its voxels with other structures, which keep them: correct the segmentation where they overlap.</source>
        <translation>El segmento «{segment}» comparte el {percent:.0f} % de sus vóxeles con otras estructuras, que los conservan: corrija la segmentación donde se solapan.</translation>
    </message>
</context>
<context>
    <name>study.xray_reading</name>
    <message>
        <source>the table of X-rays</source>
        <translation>la tabla de radiografías</translation>
    </message>
    <message>
        <source>initial</source>
        <translation>inicial</translation>
    </message>
    <message>
        <source>ready</source>
        <translation>lista</translation>
    </message>
    <message>
        <source>known exactly</source>
        <translation>conocida exactamente</translation>
    </message>
    <message>
        <source>none yet: it will be searched for, unless you place the C-arm</source>
        <translation>ninguna aún: se buscará, a menos que usted coloque el arco en C</translation>
    </message>
    <message>
        <source>unknown</source>
        <translation>desconocida</translation>
    </message>
    <message>
        <source>not ready</source>
        <translation>no está lista</translation>
    </message>
    <message>
        <source>none yet: an uncertain one was found, review it</source>
        <translation>ninguna aún: se encontró una incierta, revísela</translation>
    </message>
    <message>
        <source>uncertain, accepted by you</source>
        <translation>incierta, aceptada por usted</translation>
    </message>
    <message>
        <source>initial, from landmarks</source>
        <translation>inicial, por puntos de referencia</translation>
    </message>
    <message>
        <source>none yet: pick landmarks</source>
        <translation>ninguna aún: coloque puntos de referencia</translation>
    </message>
    <message>
        <source>DICOM</source>
        <translation>DICOM</translation>
    </message>
    <message>
        <source>ready; {count} warnings</source>
        <translation>lista; {count} advertencias</translation>
    </message>
    <message>
        <source>found, within {degrees:.0f} deg and {mm:.0f} mm</source>
        <translation>encontrada, con un margen de {degrees:.0f}° y {mm:.0f} mm</translation>
    </message>
    <message>
        <source>initial, within {degrees:.0f} deg and {mm:.0f} mm</source>
        <translation>inicial, con un margen de {degrees:.0f}° y {mm:.0f} mm</translation>
    </message>
    <message>
        <source>transform</source>
        <translation>transformación</translation>
    </message>
    <message>
        <source>image only</source>
        <translation>solo la imagen</translation>
    </message>
    <message>
        <source>{file} does not describe the geometry of &apos;{xray}&apos;: choose a study file with an entry for it.</source>
        <translation>{file} no describe la geometría de «{xray}»: elija un archivo de estudio con una entrada para ella.</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>Advertencia: {text}</translation>
    </message>
    <message>
        <source>known, from a file</source>
        <translation>conocida, de un archivo</translation>
    </message>
    <message>
        <source>geometry file</source>
        <translation>archivo de geometría</translation>
    </message>
    <message>
        <source>entered</source>
        <translation>introducida</translation>
    </message>
    <message>
        <source>{file} cannot be read as JSON ({reason}): choose a study file.</source>
        <translation>{file} no se puede leer como JSON ({reason}): elija un archivo de estudio.</translation>
    </message>
    <message>
        <source>It cannot be read: {reason}.</source>
        <translation>No se puede leer: {reason}.</translation>
    </message>
</context>
<context>
    <name>study.xray_series</name>
    <message>
        <source>The sequence &apos;{name}&apos; has {count} images, but its file has {in_file}: load it again from its file.</source>
        <translation>La secuencia &apos;{name}&apos; tiene {count} imágenes, pero su archivo tiene {in_file}: cárguela de nuevo desde su archivo.</translation>
    </message>
    <message>
        <source>Image {number} of the sequence &apos;{name}&apos; has another size, type or spacing than the first: choose a sequence of one camera.</source>
        <translation>La imagen {number} de la secuencia &apos;{name}&apos; tiene otro tamaño, tipo o espaciado que la primera: elija una secuencia de una sola cámara.</translation>
    </message>
</context>
<context>
    <name>study.xray_source</name>
    <message>
        <source>The stored fields of an X-ray are damaged: remove the X-ray and add it again.</source>
        <translation>Los campos guardados de una radiografía están dañados: quite la radiografía y añádala de nuevo.</translation>
    </message>
    <message>
        <source>An X-ray needs an image of the scene or a file: choose one.</source>
        <translation>Una radiografía necesita una imagen de la escena o un archivo: elija uno de los dos.</translation>
    </message>
    <message>
        <source>The sequence &apos;{name}&apos; has {count} images: choose one of them as the frame.</source>
        <translation>La secuencia «{name}» tiene {count} imágenes: elija una de ellas.</translation>
    </message>
    <message>
        <source>The sequence &apos;{name}&apos; does not hold images: choose another.</source>
        <translation>La secuencia «{name}» no contiene imágenes: elija otra.</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is not an image: choose a volume or a sequence of volumes.</source>
        <translation>«{name}» no es una imagen: elija un volumen o una secuencia de volúmenes.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; has no pixels: load it again.</source>
        <translation>La radiografía «{name}» no tiene píxeles: cárguela de nuevo.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is a volume of {count} images: choose one of them as its frame.</source>
        <translation>La radiografía «{name}» es un volumen de {count} imágenes: elija una de ellas.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; has {count} images: choose one of them as its frame.</source>
        <translation>La radiografía «{name}» tiene {count} imágenes: elija una de ellas.</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is a file and not an image of the scene: load it.</source>
        <translation>La radiografía «{name}» es un archivo y no una imagen de la escena: cárguela.</translation>
    </message>
</context>
</TS>
