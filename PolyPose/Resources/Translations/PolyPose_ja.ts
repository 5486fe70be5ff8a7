<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="ja" sourcelanguage="en">
<context>
    <name>PolyPose</name>
    <message>
        <source>Aligns one CT to two or more X-rays of the same patient in another posture: every bone keeps its shape and gets its own rigid motion, soft tissue follows smoothly. Research software, not for clinical decisions.</source>
        <translation>1つのCTを、別の姿勢で撮影した同じ患者の2枚以上のX線画像に位置合わせします。各骨は形を保ったまま個別に剛体運動し、軟部組織は滑らかに追従します。研究用ソフトウェアであり、臨床判断には使用できません。</translation>
    </message>
    <message>
        <source>The method is the polyrigid 2D/3D registration of Gopalakrishnan et al. (PolyPose, 2025).</source>
        <translation>手法はGopalakrishnanらのポリリジッド2D/3D位置合わせ(PolyPose, 2025)です。</translation>
    </message>
    <message>
        <source>Research software, not for clinical decisions.</source>
        <translation>研究用ソフトウェアです。臨床判断には使用できません。</translation>
    </message>
    <message>
        <source>1. CT and bones</source>
        <translation>1. CTと骨</translation>
    </message>
    <message>
        <source>CT:</source>
        <translation>CT:</translation>
    </message>
    <message>
        <source>The preoperative CT, in Hounsfield units.</source>
        <translation>術前CT(ハンスフィールド値)。</translation>
    </message>
    <message>
        <source>Choose the CT</source>
        <translation>CTを選択</translation>
    </message>
    <message>
        <source>Segmentation:</source>
        <translation>セグメンテーション:</translation>
    </message>
    <message>
        <source>Segmentation of the CT with one segment per bone.</source>
        <translation>骨ごとに1つのセグメントを持つCTのセグメンテーション。</translation>
    </message>
    <message>
        <source>Choose the segmentation</source>
        <translation>セグメンテーションを選択</translation>
    </message>
    <message>
        <source>Segment bones</source>
        <translation>骨をセグメント化</translation>
    </message>
    <message>
        <source>Segment the CT with the extension TotalSegmentator or MONAIAuto3DSeg, and propose the structures.</source>
        <translation>拡張機能 TotalSegmentator または MONAIAuto3DSeg で CT をセグメント化し、構造を提案します。</translation>
    </message>
    <message>
        <source>Propose structures</source>
        <translation>構造を提案</translation>
    </message>
    <message>
        <source>Give every segment whose name is that of a bone, as TotalSegmentator names them, its usual structure, and choose an anchor.</source>
        <translation>TotalSegmentatorの命名による骨の名前を持つ各セグメントに通常の構造を割り当て、アンカーを選択します。</translation>
    </message>
    <message>
        <source>How finely the spine and the ribs are divided.</source>
        <translation>脊椎と肋骨をどの程度細かく分けるか。</translation>
    </message>
    <message>
        <source>Spine and ribs by region</source>
        <translation>脊椎と肋骨を領域ごとに</translation>
    </message>
    <message>
        <source>Every vertebra and rib</source>
        <translation>椎骨と肋骨を1つずつ</translation>
    </message>
    <message>
        <source>Show only the segments whose name or structure contains this text.</source>
        <translation>名前または構造にこの文字列を含むセグメントだけを表示します。</translation>
    </message>
    <message>
        <source>Search segments</source>
        <translation>セグメントを検索</translation>
    </message>
    <message>
        <source>Included only</source>
        <translation>含まれるもののみ</translation>
    </message>
    <message>
        <source>Hide the segments that do not move as a bone.</source>
        <translation>骨として動かないセグメントを隠します。</translation>
    </message>
    <message>
        <source>A structure is what moves as one rigid body: segments with the same structure move together. The anchor stays where it is and defines the cameras.</source>
        <translation>構造とは1つの剛体として動くものです。同じ構造のセグメントは一緒に動きます。アンカーは動かず、カメラの基準になります。</translation>
    </message>
    <message>
        <source>2. X-rays</source>
        <translation>2. X線画像</translation>
    </message>
    <message>
        <source>A loaded X-ray: a volume of one image, or a sequence of them.</source>
        <translation>読み込まれたX線画像: 1枚の画像のボリューム、またはそのシーケンス。</translation>
    </message>
    <message>
        <source>Loaded X-ray</source>
        <translation>読み込まれたX線画像</translation>
    </message>
    <message>
        <source>Add</source>
        <translation>追加</translation>
    </message>
    <message>
        <source>Add the chosen X-ray to the table.</source>
        <translation>選択したX線画像を表に追加します。</translation>
    </message>
    <message>
        <source>Add X-rays from files.</source>
        <translation>ファイルからX線画像を追加します。</translation>
    </message>
    <message>
        <source>Files...</source>
        <translation>ファイル...</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>削除</translation>
    </message>
    <message>
        <source>Take the selected X-ray out of the table; the image itself stays.</source>
        <translation>選択したX線画像を表から外します。画像自体は残ります。</translation>
    </message>
    <message>
        <source>Geometry of the selected X-ray</source>
        <translation>選択したX線画像のジオメトリ</translation>
    </message>
    <message>
        <source>Name:</source>
        <translation>名前:</translation>
    </message>
    <message>
        <source>What this X-ray is called in tables and views.</source>
        <translation>表やビューでのこのX線画像の名前。</translation>
    </message>
    <message>
        <source>Frame:</source>
        <translation>フレーム:</translation>
    </message>
    <message>
        <source>Which image of the sequence or of the file, counted from 1.</source>
        <translation>シーケンスまたはファイルの何番目の画像か(1から数えます)。</translation>
    </message>
    <message>
        <source>Camera is:</source>
        <translation>カメラの扱い:</translation>
    </message>
    <message>
        <source>How the registration treats the camera: as an initial camera to refine, as exactly known, or as unknown.</source>
        <translation>位置合わせでのカメラの扱い: 改良する初期カメラ、正確に既知、または不明。</translation>
    </message>
    <message>
        <source>an initial camera</source>
        <translation>初期カメラ</translation>
    </message>
    <message>
        <source>known exactly</source>
        <translation>正確に既知</translation>
    </message>
    <message>
        <source>to be found</source>
        <translation>探索する</translation>
    </message>
    <message>
        <source>Source to detector [mm]:</source>
        <translation>線源-検出器間距離 [mm]:</translation>
    </message>
    <message>
        <source>Distance from the X-ray source to the detector. Leave it empty to use the value in the file.</source>
        <translation>X線源から検出器までの距離。空欄にするとファイルの値を使用します。</translation>
    </message>
    <message>
        <source>Source to isocentre [mm]:</source>
        <translation>線源-アイソセンター間距離 [mm]:</translation>
    </message>
    <message>
        <source>Distance from the X-ray source to the C-arm&apos;s isocentre. Leave it empty to use the value in the file.</source>
        <translation>X線源からCアームのアイソセンターまでの距離。空欄にするとファイルの値を使用します。</translation>
    </message>
    <message>
        <source>Distance of pixel centres, between rows and between columns.</source>
        <translation>ピクセル中心の距離(行間と列間)。</translation>
    </message>
    <message>
        <source>Pixel spacing [mm]:</source>
        <translation>ピクセル間隔 [mm]:</translation>
    </message>
    <message>
        <source>Distance between rows on the detector, not at the patient. Leave it empty to use the value in the file.</source>
        <translation>検出器上の行間の距離(患者位置ではありません)。空欄にするとファイルの値を使用します。</translation>
    </message>
    <message>
        <source>Distance between columns on the detector, not at the patient. Leave it empty to use the value in the file.</source>
        <translation>検出器上の列間の距離(患者位置ではありません)。空欄にするとファイルの値を使用します。</translation>
    </message>
    <message>
        <source>Column and row of the pixel on which the beam is perpendicular, counted from 0.</source>
        <translation>ビームが垂直に当たるピクセルの列と行(0から数えます)。</translation>
    </message>
    <message>
        <source>Principal point [px]:</source>
        <translation>主点 [px]:</translation>
    </message>
    <message>
        <source>Where the perpendicular from the source meets the detector, in the file&apos;s own pixels; the first pixel&apos;s centre is 0. Leave it empty for the centre of the image, or the value in the file.</source>
        <translation>線源からの垂線が検出器と交わる位置(ファイルのピクセル単位、最初のピクセルの中心が0)。空欄にすると画像の中心またはファイルの値を使用します。</translation>
    </message>
    <message>
        <source>The row of the same point.</source>
        <translation>同じ点の行。</translation>
    </message>
    <message>
        <source>LAO + / RAO - [deg]:</source>
        <translation>LAO + / RAO - [deg]:</translation>
    </message>
    <message>
        <source>Primary angle of the C-arm; positive with the detector toward the patient&apos;s left (LAO). Leave it empty to use the value in the file.</source>
        <translation>Cアームの一次角度。検出器が患者の左側(LAO)にあるとき正。空欄にするとファイルの値を使用します。</translation>
    </message>
    <message>
        <source>CRA + / CAU - [deg]:</source>
        <translation>CRA + / CAU - [deg]:</translation>
    </message>
    <message>
        <source>Secondary angle of the C-arm; positive with the detector toward the head (CRA). Leave it empty to use the value in the file.</source>
        <translation>Cアームの二次角度。検出器が頭側(CRA)にあるとき正。空欄にするとファイルの値を使用します。</translation>
    </message>
    <message>
        <source>Patient position:</source>
        <translation>患者体位:</translation>
    </message>
    <message>
        <source>Head or feet first; supine, prone or on one side. Used with angles that are entered here.</source>
        <translation>頭または足が先、仰臥位・腹臥位・側臥位。ここで入力した角度とともに使用します。</translation>
    </message>
    <message>
        <source>Image seen from:</source>
        <translation>画像を見る側:</translation>
    </message>
    <message>
        <source>C-arms display the image as seen from the detector; a film on a view box may be the other way round.</source>
        <translation>Cアームは検出器側から見た画像を表示します。シャウカステン上のフィルムは逆向きの場合があります。</translation>
    </message>
    <message>
        <source>as in the file</source>
        <translation>ファイルのとおり</translation>
    </message>
    <message>
        <source>the detector (mirrored)</source>
        <translation>検出器(反転)</translation>
    </message>
    <message>
        <source>the source</source>
        <translation>線源</translation>
    </message>
    <message>
        <source>Distortion:</source>
        <translation>歪み:</translation>
    </message>
    <message>
        <source>Image intensifiers bend straight lines. An image with a round field counts as distorted, and its uncertainties are wider, unless it was corrected.</source>
        <translation>イメージインテンシファイアは直線を曲げます。円形視野の画像は、補正済みでない限り歪みがあるものとして扱われ、不確かさが大きくなります。</translation>
    </message>
    <message>
        <source>by the field&apos;s shape</source>
        <translation>視野の形による</translation>
    </message>
    <message>
        <source>corrected</source>
        <translation>補正済み</translation>
    </message>
    <message>
        <source>not corrected</source>
        <translation>未補正</translation>
    </message>
    <message>
        <source>Camera&apos;s transform:</source>
        <translation>カメラの変換:</translation>
    </message>
    <message>
        <source>A transform from the camera&apos;s axes (x along the columns, y down the rows, z toward the detector) to the patient; it is made by &apos;Use as initial camera&apos;.</source>
        <translation>カメラの軸(xは列方向、yは行の下方向、zは検出器方向)から患者への変換。「初期カメラとして使用」で作成されます。</translation>
    </message>
    <message>
        <source>None</source>
        <translation>なし</translation>
    </message>
    <message>
        <source>Read geometry from a file...</source>
        <translation>ファイルからジオメトリを読み込む...</translation>
    </message>
    <message>
        <source>Take distances, angles and the camera from a study file (JSON), for the X-ray of the same name or place in it.</source>
        <translation>スタディファイル(JSON)から、同じ名前または同じ順番のX線画像の距離、角度、カメラを取り込みます。</translation>
    </message>
    <message>
        <source>Clear entered geometry</source>
        <translation>入力したジオメトリを消去</translation>
    </message>
    <message>
        <source>Use the values in the image&apos;s own file again.</source>
        <translation>画像自身のファイルの値を再び使用します。</translation>
    </message>
    <message>
        <source>3. Initial cameras (optional)</source>
        <translation>3. 初期カメラ(任意)</translation>
    </message>
    <message>
        <source>Where the registration of the selected X-ray starts; it refines every camera that is not known exactly.</source>
        <translation>選択したX線画像の位置合わせの開始点。正確に既知でないカメラはすべて改良されます。</translation>
    </message>
    <message>
        <source>Camera source:</source>
        <translation>カメラソース:</translation>
    </message>
    <message>
        <source>Where the initial camera of the selected X-ray comes from.</source>
        <translation>選択したX線画像の初期カメラの出所。</translation>
    </message>
    <message>
        <source>Search near:</source>
        <translation>探索の中心:</translation>
    </message>
    <message>
        <source>The view as it was ordered; the search stays within 45 degrees of it. Position of the detector: AP behind the patient, PA in front, LL at the left side, RL at the right side.</source>
        <translation>指示された撮影方向。探索はその45度以内で行います。検出器の位置: AP は患者の背側、PA は腹側、LL は左側、RL は右側。</translation>
    </message>
    <message>
        <source>Calibration:</source>
        <translation>キャリブレーション:</translation>
    </message>
    <message>
        <source>A calibrated camera: a 3x4 projection matrix (CSV or JSON), a MayaCam 2.0 text, or intrinsics with distortion (JSON). Its pose is used only when the calibration is the camera source; it must then be given in the CT&apos;s coordinates (LPS, mm).</source>
        <translation>キャリブレーション済みカメラ: 3x4投影行列(CSVまたはJSON)、MayaCam 2.0のテキスト、または歪みを含む内部パラメーター(JSON)。その位置姿勢は、キャリブレーションがカメラソースのときだけ使用され、その場合はCTの座標系(LPS, mm)で与える必要があります。</translation>
    </message>
    <message>
        <source>Camera model:</source>
        <translation>カメラモデル:</translation>
    </message>
    <message>
        <source>A model trained by python -m PolyPoseLib train on this CT and this anchor; models of other CTs are refused.</source>
        <translation>このCTとこのアンカーで python -m PolyPoseLib train により学習したモデル。他のCTのモデルは使用できません。</translation>
    </message>
    <message>
        <source>Rig:</source>
        <translation>リグ:</translation>
    </message>
    <message>
        <source>none: this camera is independent</source>
        <translation>なし: このカメラは独立です</translation>
    </message>
    <message>
        <source>Name of the calibrated rig, such as a biplane stand, that took this X-ray. Give the same name to the other X-rays of the rig: their cameras keep the relative pose of their calibrations, and what is found for one places the others.</source>
        <translation>このX線画像を撮影した、バイプレーン装置などのキャリブレーション済みリグの名前。同じリグの他のX線画像にも同じ名前を付けてください。カメラはキャリブレーションの相対位置姿勢を保ち、1つについて見つかれば他も定まります。</translation>
    </message>
    <message>
        <source>Landmarks</source>
        <translation>ランドマーク</translation>
    </message>
    <message>
        <source>Pick four or more points on the anchor, far apart and not in one line, in the CT and in the X-ray. Points with the same name form a pair.</source>
        <translation>CTとX線画像の両方で、アンカー上に、互いに離れて一直線に並ばない4点以上を配置してください。同じ名前の点が組になります。</translation>
    </message>
    <message>
        <source>In the CT:</source>
        <translation>CT:</translation>
    </message>
    <message>
        <source>Points in the CT; X-rays may share a list.</source>
        <translation>CTの点。複数のX線画像でリストを共有できます。</translation>
    </message>
    <message>
        <source>None yet</source>
        <translation>まだありません</translation>
    </message>
    <message>
        <source>Pick</source>
        <translation>配置</translation>
    </message>
    <message>
        <source>Pick points in the slices or on the bones in 3D; press again, or click the right mouse button, to end.</source>
        <translation>スライスまたは3Dの骨の上に点を配置します。もう一度押すか右クリックすると終了します。</translation>
    </message>
    <message>
        <source>In the X-ray:</source>
        <translation>X線画像:</translation>
    </message>
    <message>
        <source>Points in this X-ray; each X-ray has its own list.</source>
        <translation>このX線画像の点。X線画像ごとに専用のリストがあります。</translation>
    </message>
    <message>
        <source>Show the X-ray in its own view, and pick points there; press again, or click the right mouse button, to end.</source>
        <translation>X線画像を専用のビューに表示し、そこに点を配置します。もう一度押すか右クリックすると終了します。</translation>
    </message>
    <message>
        <source>How far each landmark of the CT projects from its counterpart in the X-ray: in mm at its depth, and in pixels.</source>
        <translation>CTの各ランドマークの投影と、X線画像の対応点との距離(その深さでのmmとピクセル)。</translation>
    </message>
    <message>
        <source>Remove pair</source>
        <translation>組を削除</translation>
    </message>
    <message>
        <source>Delete the selected landmark from both lists.</source>
        <translation>選択したランドマークを両方のリストから削除します。</translation>
    </message>
    <message>
        <source>Find camera</source>
        <translation>カメラを探す</translation>
    </message>
    <message>
        <source>Find the camera of the selected X-ray; without it, the registration searches when it starts.</source>
        <translation>選択したX線画像のカメラを探します。探さない場合は位置合わせの開始時に探索されます。</translation>
    </message>
    <message>
        <source>Find all</source>
        <translation>すべて探す</translation>
    </message>
    <message>
        <source>Find the camera of every X-ray that has none.</source>
        <translation>カメラのないすべてのX線画像のカメラを探します。</translation>
    </message>
    <message>
        <source>Show</source>
        <translation>表示</translation>
    </message>
    <message>
        <source>Show the CT rendered by this camera over the X-ray, and the C-arm in 3D.</source>
        <translation>このカメラでレンダリングしたCTをX線画像の上に、Cアームを3Dに表示します。</translation>
    </message>
    <message>
        <source>Accept</source>
        <translation>承認</translation>
    </message>
    <message>
        <source>Start the registration from this uncertain camera.</source>
        <translation>この不確実なカメラから位置合わせを開始します。</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>破棄</translation>
    </message>
    <message>
        <source>Discard the camera that was found.</source>
        <translation>見つかったカメラを破棄します。</translation>
    </message>
    <message>
        <source>4. Place the C-arm (optional)</source>
        <translation>4. Cアームの配置(任意)</translation>
    </message>
    <message>
        <source>Move the sliders until the rendering of the CT lies on the X-ray. It need not be exact: the registration refines it.</source>
        <translation>CTのレンダリングがX線画像に重なるまでスライダーを動かしてください。正確でなくても、位置合わせで改良されます。</translation>
    </message>
    <message>
        <source>LAO + / RAO -:</source>
        <translation>LAO + / RAO -:</translation>
    </message>
    <message>
        <source>Primary angle; positive with the detector toward the patient&apos;s left.</source>
        <translation>一次角度。検出器が患者の左側にあるとき正。</translation>
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
        <translation>二次角度。検出器が頭側にあるとき正。</translation>
    </message>
    <message>
        <source>Image rotation:</source>
        <translation>画像の回転:</translation>
    </message>
    <message>
        <source>Rotation of the detector about the beam.</source>
        <translation>ビームまわりの検出器の回転。</translation>
    </message>
    <message>
        <source>Source to isocentre:</source>
        <translation>線源-アイソセンター間距離:</translation>
    </message>
    <message>
        <source>Distance from the source to the isocentre.</source>
        <translation>線源からアイソセンターまでの距離。</translation>
    </message>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>Source to detector:</source>
        <translation>線源-検出器間距離:</translation>
    </message>
    <message>
        <source>Distance from the source to the detector.</source>
        <translation>線源から検出器までの距離。</translation>
    </message>
    <message>
        <source>Table to the left:</source>
        <translation>テーブル左方向:</translation>
    </message>
    <message>
        <source>How far the patient lies to his or her left of the isocentre.</source>
        <translation>患者がアイソセンターから患者の左へどれだけ離れているか。</translation>
    </message>
    <message>
        <source>Table to the front:</source>
        <translation>テーブル前方向:</translation>
    </message>
    <message>
        <source>How far the patient lies to the front of the isocentre.</source>
        <translation>患者がアイソセンターから前方へどれだけ離れているか。</translation>
    </message>
    <message>
        <source>Table to the head:</source>
        <translation>テーブル頭方向:</translation>
    </message>
    <message>
        <source>How far the patient lies toward the head from the isocentre.</source>
        <translation>患者がアイソセンターから頭側へどれだけ離れているか。</translation>
    </message>
    <message>
        <source>Overlay:</source>
        <translation>重ね合わせ:</translation>
    </message>
    <message>
        <source>How much of the rendering is seen over the X-ray.</source>
        <translation>X線画像の上にレンダリングをどの程度表示するか。</translation>
    </message>
    <message>
        <source> %</source>
        <translation> %</translation>
    </message>
    <message>
        <source>Show live</source>
        <translation>ライブ表示</translation>
    </message>
    <message>
        <source>Render the CT over the selected X-ray while the sliders move.</source>
        <translation>スライダーを動かす間、選択したX線画像の上にCTをレンダリングします。</translation>
    </message>
    <message>
        <source>Back to what the X-ray&apos;s own geometry says.</source>
        <translation>X線画像自身のジオメトリに戻します。</translation>
    </message>
    <message>
        <source>Reset</source>
        <translation>リセット</translation>
    </message>
    <message>
        <source>Use as initial camera</source>
        <translation>初期カメラとして使用</translation>
    </message>
    <message>
        <source>Start the registration of this X-ray from the camera that is shown.</source>
        <translation>表示中のカメラからこのX線画像の位置合わせを開始します。</translation>
    </message>
    <message>
        <source>5. Settings</source>
        <translation>5. 設定</translation>
    </message>
    <message>
        <source>Preset:</source>
        <translation>プリセット:</translation>
    </message>
    <message>
        <source>How thorough the registration is.</source>
        <translation>位置合わせをどの程度綿密に行うか。</translation>
    </message>
    <message>
        <source>Compute on:</source>
        <translation>計算装置:</translation>
    </message>
    <message>
        <source>A graphics card is used when there is one, unless the processor is chosen.</source>
        <translation>プロセッサーを選択しない限り、グラフィックカードがあれば使用します。</translation>
    </message>
    <message>
        <source>Show the curve of the similarity beside the slices.</source>
        <translation>類似度の曲線をスライスの横に表示します。</translation>
    </message>
    <message>
        <source>Show the similarity in the layout</source>
        <translation>レイアウトに類似度を表示</translation>
    </message>
    <message>
        <source>Advanced</source>
        <translation>詳細</translation>
    </message>
    <message>
        <source>Update the slices while it runs</source>
        <translation>実行中にスライスを更新</translation>
    </message>
    <message>
        <source>Refresh the transform while the registration runs.</source>
        <translation>位置合わせの実行中に変換を更新します。</translation>
    </message>
    <message>
        <source>Refine the cameras</source>
        <translation>カメラを改良</translation>
    </message>
    <message>
        <source>Refine the cameras by aligning the anchor before the other bones move.</source>
        <translation>他の骨が動く前に、アンカーを合わせてカメラを改良します。</translation>
    </message>
    <message>
        <source>Compute uncertainty</source>
        <translation>不確かさを計算</translation>
    </message>
    <message>
        <source>Estimate the uncertainty of each motion; takes a little longer.</source>
        <translation>各動きの不確かさを推定します。少し時間がかかります。</translation>
    </message>
    <message>
        <source>Threads:</source>
        <translation>スレッド数:</translation>
    </message>
    <message>
        <source>Number of processor threads.</source>
        <translation>プロセッサーのスレッド数。</translation>
    </message>
    <message>
        <source>all</source>
        <translation>すべて</translation>
    </message>
    <message>
        <source>Random seed:</source>
        <translation>乱数シード:</translation>
    </message>
    <message>
        <source>The same seed gives the same result on the same machine.</source>
        <translation>同じコンピューターでは、同じシードで同じ結果になります。</translation>
    </message>
    <message>
        <source>Keep the result folder in:</source>
        <translation>結果フォルダーの保存先:</translation>
    </message>
    <message>
        <source>A new folder in which to keep result.json, the ITK transform and the images. Leave it empty to keep only the nodes in the scene.</source>
        <translation>result.json、ITK変換、画像を保存する新しいフォルダー。空欄にするとシーンのノードだけを残します。</translation>
    </message>
    <message>
        <source>6. Review</source>
        <translation>6. 確認</translation>
    </message>
    <message>
        <source>Show PolyPose layout</source>
        <translation>PolyPoseレイアウトを表示</translation>
    </message>
    <message>
        <source>X-rays in a row, the 3D view with the C-arms, and the three slices.</source>
        <translation>横に並べたX線画像、Cアームのある3Dビュー、3つのスライス。</translation>
    </message>
    <message>
        <source>Load result...</source>
        <translation>結果を読み込む...</translation>
    </message>
    <message>
        <source>Open the folder of an earlier registration.</source>
        <translation>以前の位置合わせのフォルダーを開きます。</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>元に戻す</translation>
    </message>
    <message>
        <source>Compare</source>
        <translation>比較</translation>
    </message>
    <message>
        <source>CT and bones</source>
        <translation>CT と骨</translation>
    </message>
    <message>
        <source>Before (as in the CT)</source>
        <translation>前(CTのとおり)</translation>
    </message>
    <message>
        <source>Show the CT and its segmentation where they were scanned (Ctrl+Shift+B swaps).</source>
        <translation>CTとそのセグメンテーションを撮影時の位置に表示します(Ctrl+Shift+B で切り替え)。</translation>
    </message>
    <message>
        <source>After (as in the X-rays)</source>
        <translation>後(X線画像のとおり)</translation>
    </message>
    <message>
        <source>Show the CT and its segmentation in the posture of the X-rays, through the transform.</source>
        <translation>変換を通して、CTとそのセグメンテーションをX線画像の姿勢で表示します。</translation>
    </message>
    <message>
        <source>Only the bones that move</source>
        <translation>動く骨のみ</translation>
    </message>
    <message>
        <source>Hide the segments that belong to no structure.</source>
        <translation>どの構造にも属さないセグメントを隠します。</translation>
    </message>
    <message>
        <source>Bones in 3D</source>
        <translation>骨を 3D で表示</translation>
    </message>
    <message>
        <source>Show the bones that move as surfaces in the 3D view, where the chosen posture has them.</source>
        <translation>動く骨を、選択した姿勢での位置で 3D ビューにサーフェスとして表示します。</translation>
    </message>
    <message>
        <source>X-ray versus rendering</source>
        <translation>X線画像とレンダリングの比較</translation>
    </message>
    <message>
        <source>View:</source>
        <translation>ビュー:</translation>
    </message>
    <message>
        <source>The X-ray to compare with its rendering.</source>
        <translation>レンダリングと比較するX線画像。</translation>
    </message>
    <message>
        <source>Compare by:</source>
        <translation>比較方法:</translation>
    </message>
    <message>
        <source>How X-ray and rendering are shown in one image.</source>
        <translation>X線画像とレンダリングを1つの画像に表示する方法。</translation>
    </message>
    <message>
        <source>Blend</source>
        <translation>ブレンド</translation>
    </message>
    <message>
        <source>Checkerboard</source>
        <translation>チェッカーボード</translation>
    </message>
    <message>
        <source>Flicker</source>
        <translation>フリッカー</translation>
    </message>
    <message>
        <source>Edges of the rendering</source>
        <translation>レンダリングのエッジ</translation>
    </message>
    <message>
        <source>X-ray alone</source>
        <translation>X線画像のみ</translation>
    </message>
    <message>
        <source>Rendering alone</source>
        <translation>レンダリングのみ</translation>
    </message>
    <message>
        <source>Amount:</source>
        <translation>量:</translation>
    </message>
    <message>
        <source>Share of the rendering in a blend; size of the squares; strength of the edges.</source>
        <translation>ブレンドでのレンダリングの割合、市松模様の大きさ、エッジの強さ。</translation>
    </message>
    <message>
        <source>Seen from the detector, as C-arms display</source>
        <translation>Cアームの表示と同じく検出器側から見る</translation>
    </message>
    <message>
        <source>Off: as seen from the X-ray source.</source>
        <translation>オフ: X線源側から見た表示。</translation>
    </message>
    <message>
        <source>Deformation</source>
        <translation>変形</translation>
    </message>
    <message>
        <source>Grid</source>
        <translation>グリッド</translation>
    </message>
    <message>
        <source>Show the deformation as a grid, in the slices.</source>
        <translation>変形を格子としてスライスに表示します。</translation>
    </message>
    <message>
        <source>Show the deformation as arrows, in the slices and in 3D.</source>
        <translation>変形を矢印としてスライスと 3D に表示します。</translation>
    </message>
    <message>
        <source>Arrows</source>
        <translation>矢印</translation>
    </message>
    <message>
        <source>One row per X-ray: where its geometry comes from and how reliable it is. Image files, and loaded X-rays from a tree of the data, can be dropped here.</source>
        <translation>X線画像ごとに 1 行：ジオメトリの出所と信頼性。画像ファイルや、データツリーの読み込み済み X線画像をここにドロップできます。</translation>
    </message>
    <message>
        <source>Volume change</source>
        <translation>体積変化</translation>
    </message>
    <message>
        <source>Show by colour where tissue grows or shrinks (Jacobian determinant); folds are marked.</source>
        <translation>組織が膨張または収縮する場所を色で表示します(ヤコビ行列式)。折り重なりには印が付きます。</translation>
    </message>
    <message>
        <source>Weight of:</source>
        <translation>重みの対象:</translation>
    </message>
    <message>
        <source>Show how strongly a structure&apos;s motion influences each point.</source>
        <translation>構造の動きが各点にどの程度影響するかを表示します。</translation>
    </message>
    <message>
        <source>Motions</source>
        <translation>動き</translation>
    </message>
    <message>
        <source>Motions of the bones</source>
        <translation>骨の動き</translation>
    </message>
    <message>
        <source>Relative to:</source>
        <translation>基準:</translation>
    </message>
    <message>
        <source>Motions are shown as seen from this structure.</source>
        <translation>この構造から見た動きを表示します。</translation>
    </message>
    <message>
        <source>Rotation, displacement of the centroid and axis of each structure, from the CT to the X-rays.</source>
        <translation>CTからX線画像への各構造の回転、重心の変位、軸。</translation>
    </message>
    <message>
        <source>Copy</source>
        <translation>コピー</translation>
    </message>
    <message>
        <source>Copy the table, ready to be pasted into a spreadsheet.</source>
        <translation>表計算ソフトに貼り付けられるように表をコピーします。</translation>
    </message>
    <message>
        <source>Save as CSV...</source>
        <translation>CSVとして保存...</translation>
    </message>
    <message>
        <source>Write the table into a file.</source>
        <translation>表をファイルに書き込みます。</translation>
    </message>
    <message>
        <source>Save report...</source>
        <translation>レポートを保存...</translation>
    </message>
    <message>
        <source>Write one HTML page with inputs, motions, pictures and warnings.</source>
        <translation>入力、動き、画像、警告を含むHTMLページを書き込みます。</translation>
    </message>
    <message>
        <source>Save result as a scene...</source>
        <translation>結果をシーンとして保存...</translation>
    </message>
    <message>
        <source>Write the CT, its segmentation and the result alone into a scene of their own (.mrb), which opens in any Slicer, without this module too.</source>
        <translation>CT、そのセグメンテーション、結果だけを専用のシーン(.mrb)に書き込みます。このモジュールがないSlicerでも開けます。</translation>
    </message>
    <message>
        <source>Carry</source>
        <translation>追従</translation>
    </message>
    <message>
        <source>Carry along</source>
        <translation>追従</translation>
    </message>
    <message>
        <source>Markups, models, segmentations, volumes and RT doses of the CT: what is checked follows Before and After, and the registration while it runs.</source>
        <translation>CTのマークアップ、モデル、セグメンテーション、ボリューム、RT線量。チェックしたものは「前」と「後」の切り替えと、実行中の位置合わせに追従します。</translation>
    </message>
    <message>
        <source>95 % ellipsoids of points</source>
        <translation>点の95 %楕円体</translation>
    </message>
    <message>
        <source>How far each carried point may be off, in 3D and in the slices; shown with After.</source>
        <translation>追従させた各点のずれの範囲を、3Dと断面に示します。「後」のときに表示されます。</translation>
    </message>
    <message>
        <source>Result for planning systems</source>
        <translation>計画システム用の結果</translation>
    </message>
    <message>
        <source>Export as DICOM...</source>
        <translation>DICOMとして書き出す...</translation>
    </message>
    <message>
        <source>Write the warped CT, the segmentation, every bone&apos;s motion and the deformation as DICOM objects, for planning systems.</source>
        <translation>変形したCT、セグメンテーション、各骨の動き、変形を、計画システム用のDICOMオブジェクトとして書き出します。</translation>
    </message>
    <message>
        <source>Adjust</source>
        <translation>調整</translation>
    </message>
    <message>
        <source>Bones moved by hand</source>
        <translation>手動で動かした骨</translation>
    </message>
    <message>
        <source>The bone that the handles move.</source>
        <translation>ハンドルで動かす骨。</translation>
    </message>
    <message>
        <source>Show handles</source>
        <translation>ハンドルを表示</translation>
    </message>
    <message>
        <source>Show Slicer&apos;s handles on this bone, in 3D and in the slices, and its outline on the X-rays.</source>
        <translation>この骨にSlicerのハンドルを3Dとスライスで表示し、その輪郭をX線画像に表示します。</translation>
    </message>
    <message>
        <source>Put back</source>
        <translation>戻す</translation>
    </message>
    <message>
        <source>Put all bones back where the result has them.</source>
        <translation>すべての骨を結果の位置に戻します。</translation>
    </message>
    <message>
        <source>Refine from here</source>
        <translation>ここから改良</translation>
    </message>
    <message>
        <source>Fit cameras and bones again from where they are now; Undo brings this result back.</source>
        <translation>現在の位置からカメラと骨を再度合わせます。「元に戻す」でこの結果に戻ります。</translation>
    </message>
    <message>
        <source>7. Motion</source>
        <translation>7. 動き</translation>
    </message>
    <message>
        <source>Frames per second:</source>
        <translation>毎秒のフレーム数:</translation>
    </message>
    <message>
        <source>Of all cameras. Where it is left alone, it is what DICOM or the times of the images state.</source>
        <translation>すべてのカメラに共通です。変更しなければ、DICOM または画像の時刻が示す値を使います。</translation>
    </message>
    <message>
        <source>as the images state</source>
        <translation>画像の記載どおり</translation>
    </message>
    <message>
        <source>Frames:</source>
        <translation>フレーム:</translation>
    </message>
    <message>
        <source>The first frame that is tracked, counted from 0. Frame 0 is the first that all cameras have; the images that the X-rays show (Frame) belong together.</source>
        <translation>追跡する最初のフレーム（0 から数えます）。フレーム 0 はすべてのカメラにある最初のフレームで、X線像に表示されている画像（フレーム）は同じ時刻のものとみなします。</translation>
    </message>
    <message>
        <source>to</source>
        <translation>～</translation>
    </message>
    <message>
        <source>The last frame that is tracked.</source>
        <translation>追跡する最後のフレーム。</translation>
    </message>
    <message>
        <source>Reference:</source>
        <translation>基準:</translation>
    </message>
    <message>
        <source>The structure relative to which the motion of the others is reported; it moves, too.</source>
        <translation>他の構造の動きを示す基準となる構造。これ自身も動きます。</translation>
    </message>
    <message>
        <source>Start:</source>
        <translation>開始:</translation>
    </message>
    <message>
        <source>Where the bones are looked for in the first frame.</source>
        <translation>最初のフレームで骨をどこから探すか。</translation>
    </message>
    <message>
        <source>Standing still:</source>
        <translation>静止:</translation>
    </message>
    <message>
        <source>Structures that do not move during the sequence.</source>
        <translation>シーケンスの間に動かない構造。</translation>
    </message>
    <message>
        <source>Go back once more, and keep the better poses</source>
        <translation>逆方向にもう一度たどり、良い方の姿勢を残す</translation>
    </message>
    <message>
        <source>A second pass goes from the last frame to the first; it finds bones again that were lost behind others.</source>
        <translation>2 回目は最後のフレームから最初へ戻り、他の骨に隠れて見失った骨を再び見つけます。</translation>
    </message>
    <message>
        <source>Smooth the poses</source>
        <translation>姿勢を平滑化</translation>
    </message>
    <message>
        <source>Smooth the poses with their own uncertainty. A smoothed track cannot be corrected afterwards.</source>
        <translation>姿勢をそれ自身の不確かさで平滑化します。平滑化した追跡は後から修正できません。</translation>
    </message>
    <message>
        <source>Track</source>
        <translation>追跡する</translation>
    </message>
    <message>
        <source>Go on</source>
        <translation>続行</translation>
    </message>
    <message>
        <source>Go on with the frames that the interrupted tracking has left.</source>
        <translation>中断した追跡が残したフレームの続きから再開します。</translation>
    </message>
    <message>
        <source>Tracked</source>
        <translation>追跡結果</translation>
    </message>
    <message>
        <source>Previous doubtful</source>
        <translation>前の疑わしいフレーム</translation>
    </message>
    <message>
        <source>Go to the frame before this one whose poses are doubtful.</source>
        <translation>このフレームより前の、姿勢が疑わしいフレームへ移動します。</translation>
    </message>
    <message>
        <source>Next doubtful</source>
        <translation>次の疑わしいフレーム</translation>
    </message>
    <message>
        <source>Go to the frame after this one whose poses are doubtful.</source>
        <translation>このフレームより後の、姿勢が疑わしいフレームへ移動します。</translation>
    </message>
    <message>
        <source>The bone that is corrected.</source>
        <translation>修正する骨。</translation>
    </message>
    <message>
        <source>Correct</source>
        <translation>修正</translation>
    </message>
    <message>
        <source>Show handles on this bone: drag it until its outlines match the X-rays. It belongs to this frame, and is kept when you go to another one.</source>
        <translation>この骨にハンドルを表示します。輪郭が X線像に合うまでドラッグしてください。修正はこのフレームのもので、他のフレームへ移動しても残ります。</translation>
    </message>
    <message>
        <source>Undo correction</source>
        <translation>修正を元に戻す</translation>
    </message>
    <message>
        <source>Put the bone back where the track has it in this frame.</source>
        <translation>このフレームで追跡が示す位置に骨を戻します。</translation>
    </message>
    <message>
        <source>Which frames are tracked anew from the corrected one on.</source>
        <translation>修正したフレームから、どのフレームを追跡し直すか。</translation>
    </message>
    <message>
        <source>Track on from here</source>
        <translation>ここから追跡</translation>
    </message>
    <message>
        <source>Track anew from the bones that were corrected in this frame; other frames are kept.</source>
        <translation>このフレームで修正した骨から追跡し直します。他のフレームはそのまま残ります。</translation>
    </message>
    <message>
        <source>Show plots</source>
        <translation>グラフを表示</translation>
    </message>
    <message>
        <source>Show the X-rays with outlines, the bones, and plots of their motion.</source>
        <translation>輪郭付きの X線像、骨、動きのグラフを表示します。</translation>
    </message>
    <message>
        <source>Save track...</source>
        <translation>追跡を保存...</translation>
    </message>
    <message>
        <source>Write the track into a folder, as the command line does.</source>
        <translation>コマンドラインと同じ形で追跡をフォルダーに書き込みます。</translation>
    </message>
    <message>
        <source>Register</source>
        <translation>位置合わせ</translation>
    </message>
</context>
<context>
    <name>PolyPoseSlicer.calls</name>
    <message>
        <source>There is no result whose bones could be refined: register first.</source>
        <translation>骨を改良できる結果がありません。先に位置合わせしてください。</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is both an input and an output: choose another node for the output.</source>
        <translation>「{name}」が入力と出力の両方に使われています。出力には別のノードを選択してください。</translation>
    </message>
</context>
<context>
    <name>PolyPoseSlicer.samples</name>
    <message>
        <source>PolyPose simulates two X-rays of the sample...</source>
        <translation>PolyPoseがサンプルのX線画像を2枚シミュレーションしています...</translation>
    </message>
    <message>
        <source>{program} could not be started ({reason}): install Slicer again.</source>
        <translation>{program} を起動できませんでした({reason})。Slicerを再インストールしてください。</translation>
    </message>
</context>
<context>
    <name>panel.adjustment</name>
    <message>
        <source>Move a bone with the handles in 3D and in the slices: its outline on the X-rays follows. Then refine: all bones are fitted from where they are, and none is looked for elsewhere.</source>
        <translation>3Dとスライスのハンドルで骨を動かすと、X線画像上の輪郭が追従します。次に改良すると、すべての骨が現在の位置から合わせられ、他の場所は探索されません。</translation>
    </message>
    <message>
        <source>Bones can be adjusted once there is a result.</source>
        <translation>結果があれば骨を調整できます。</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; has no voxel in the warped segmentation: register again, or choose another bone.</source>
        <translation>「{name}」は変形したセグメンテーションにボクセルがありません。再度位置合わせするか、別の骨を選択してください。</translation>
    </message>
</context>
<context>
    <name>panel.camera_text</name>
    <message>
        <source>No other view scores nearly as high.</source>
        <translation>これに近いスコアのビューは他にありません。</translation>
    </message>
    <message>
        <source>This X-ray is not ready: complete its geometry above.</source>
        <translation>このX線画像は準備ができていません。上でジオメトリを入力してください。</translation>
    </message>
    <message>
        <source>The pose in the calibration is used; it must be given in the CT&apos;s coordinates (LPS, mm).</source>
        <translation>キャリブレーションの位置姿勢を使用します。CTの座標系(LPS, mm)で与える必要があります。</translation>
    </message>
    <message>
        <source>Its file gives no angles: choose another camera source.</source>
        <translation>ファイルに角度がありません。別のカメラソースを選択してください。</translation>
    </message>
    <message>
        <source>Choose the model file; python -m PolyPoseLib train makes one for this CT.</source>
        <translation>モデルファイルを選択してください。このCT用のモデルは python -m PolyPoseLib train で作成できます。</translation>
    </message>
    <message>
        <source>Not searched for yet: press Find camera, or the registration will search when it starts.</source>
        <translation>まだ探索していません。「カメラを探す」を押すか、位置合わせの開始時に探索されます。</translation>
    </message>
    <message>
        <source>Found: {how}.</source>
        <translation>検出: {how}。</translation>
    </message>
    <message>
        <source>Expected accuracy: {degrees:.0f} deg and {mm:.0f} mm.</source>
        <translation>予想精度: {degrees:.0f}°、{mm:.0f} mm。</translation>
    </message>
    <message>
        <source>It is uncertain, and in use because you accepted it.</source>
        <translation>不確実ですが、承認されたため使用しています。</translation>
    </message>
    <message>
        <source>It is uncertain and not in use: show it, then accept or discard it.</source>
        <translation>不確実なため使用していません。表示して確認し、承認または破棄してください。</translation>
    </message>
    <message>
        <source>Choose the calibration file.</source>
        <translation>キャリブレーションファイルを選択してください。</translation>
    </message>
</context>
<context>
    <name>panel.cameras</name>
    <message>
        <source>Find camera</source>
        <translation>カメラを探す</translation>
    </message>
    <message>
        <source>all directions</source>
        <translation>すべての方向</translation>
    </message>
    <message>
        <source>Calibration files</source>
        <translation>キャリブレーションファイル</translation>
    </message>
    <message>
        <source>All files</source>
        <translation>すべてのファイル</translation>
    </message>
    <message>
        <source>Every X-ray already has an initial camera.</source>
        <translation>すべてのX線画像に初期カメラがあります。</translation>
    </message>
    <message>
        <source>{count} found.</source>
        <translation>{count} 件見つかりました。</translation>
    </message>
    <message>
        <source>X-rays that you changed meanwhile were left as they are.</source>
        <translation>その間に変更されたX線画像はそのままにしました。</translation>
    </message>
    <message>
        <source>Preparing the data...</source>
        <translation>データを準備しています...</translation>
    </message>
    <message>
        <source>Select an X-ray in the table.</source>
        <translation>表でX線画像を選択してください。</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>キャンセルしています...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>キャンセル</translation>
    </message>
    <message>
        <source>Stop the search; nothing is changed.</source>
        <translation>探索を中止します。何も変更されません。</translation>
    </message>
    <message>
        <source>This camera source needs no search.</source>
        <translation>このカメラソースでは探索は不要です。</translation>
    </message>
    <message>
        <source>Choose the model file.</source>
        <translation>モデルファイルを選択してください。</translation>
    </message>
    <message>
        <source>Find the camera of the selected X-ray.</source>
        <translation>選択したX線画像のカメラを探します。</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>キャンセルしました。何も変更されていません。</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>開始しています...</translation>
    </message>
    <message>
        <source>Camera of {name}</source>
        <translation>{name} のカメラ</translation>
    </message>
    <message>
        <source>{count} uncertain and not in use: select the X-ray and review it.</source>
        <translation>{count} 件は不確実で使用していません。X線画像を選択して確認してください。</translation>
    </message>
    <message>
        <source>{stage}: {iteration} of {of}</source>
        <translation>{stage}: {iteration} / {of}</translation>
    </message>
</context>
<context>
    <name>panel.carm</name>
    <message>
        <source>Preparing the CT...</source>
        <translation>CTを準備しています...</translation>
    </message>
    <message>
        <source>The registration of &apos;{name}&apos; will start from this camera.</source>
        <translation>「{name}」の位置合わせはこのカメラから開始します。</translation>
    </message>
    <message>
        <source>Choose the CT first.</source>
        <translation>先にCTを選択してください。</translation>
    </message>
    <message>
        <source>Select an X-ray that is ready.</source>
        <translation>準備のできたX線画像を選択してください。</translation>
    </message>
    <message>
        <source>Live ({milliseconds:.0f} ms per image).</source>
        <translation>ライブ(1画像 {milliseconds:.0f} ms)。</translation>
    </message>
    <message>
        <source>Initial camera of {name}</source>
        <translation>{name} の初期カメラ</translation>
    </message>
</context>
<context>
    <name>panel.carry</name>
    <message>
        <source>Is put under the result&apos;s transform while After is shown, and back for Before.</source>
        <translation>「後」を表示している間は結果の変換の下に置かれ、「前」では元に戻ります。</translation>
    </message>
    <message>
        <source>Computing...</source>
        <translation>計算しています...</translation>
    </message>
    <message>
        <source>Points inside a bone take the bone&apos;s own motion; all others, the displacement field. The markups themselves stay as they are: copies of them are shown.</source>
        <translation>骨の中の点はその骨自身の動きに、その他の点は変位場に従います。マークアップ自体は変わらず、コピーが表示されます。</translation>
    </message>
    <message>
        <source>Nothing to carry: load or make markups, models, segmentations or volumes of the CT.</source>
        <translation>追従させるものがありません。CTのマークアップ、モデル、セグメンテーション、ボリュームを読み込むか作成してください。</translation>
    </message>
    <message>
        <source>Points follow the displacement field alone: {reason}</source>
        <translation>点は変位場のみに従います：{reason}</translation>
    </message>
    <message>
        <source>Check what shall follow Before and After.</source>
        <translation>「前」と「後」に追従させるものにチェックを入れてください。</translation>
    </message>
    <message>
        <source>Choose After in the tab Compare to see it in the posture of the X-rays.</source>
        <translation>X線画像の姿勢で見るには、「比較」タブで「後」を選択してください。</translation>
    </message>
    <message>
        <source>Shown in the posture of the X-rays.</source>
        <translation>X線画像の姿勢で表示しています。</translation>
    </message>
</context>
<context>
    <name>panel.export</name>
    <message>
        <source>Added to Slicer&apos;s DICOM database.</source>
        <translation>SlicerのDICOMデータベースに追加しました。</translation>
    </message>
    <message>
        <source>Writing DICOM...</source>
        <translation>DICOMを書き出しています...</translation>
    </message>
    <message>
        <source>Export as DICOM...</source>
        <translation>DICOMとして書き出す...</translation>
    </message>
    <message>
        <source>Export as DICOM into a folder</source>
        <translation>DICOMとしてフォルダーに書き出す</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>キャンセル</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>キャンセルしました。何も変更されていません。</translation>
    </message>
    <message>
        <source>Add the exported DICOM objects to Slicer&apos;s DICOM database?</source>
        <translation>書き出したDICOMオブジェクトをSlicerのDICOMデータベースに追加しますか？</translation>
    </message>
    <message>
        <source>Stop the export; nothing is written.</source>
        <translation>書き出しを中止します。何も書き込まれません。</translation>
    </message>
    <message>
        <source>Write the warped CT, the segmentation, every bone&apos;s motion and the deformation as DICOM objects, for planning systems.</source>
        <translation>変形したCT、セグメンテーション、各骨の動き、変形を、計画システム用のDICOMオブジェクトとして書き出します。</translation>
    </message>
    <message>
        <source>Written to {folder}.</source>
        <translation>{folder} に書き出しました。</translation>
    </message>
    <message>
        <source>Export as DICOM</source>
        <translation>DICOMとして書き出す</translation>
    </message>
    <message>
        <source>Slicer&apos;s DICOM module could not add them ({reason}): add the folder there.</source>
        <translation>SlicerのDICOMモジュールが追加できませんでした（{reason}）。そこでフォルダーを追加してください。</translation>
    </message>
    <message>
        <source>The CT is not in Slicer&apos;s DICOM database: everything, the CT too, was written for the placeholder patient {name}.</source>
        <translation>CTはSlicerのDICOMデータベースにありません。CTを含むすべてを、仮の患者 {name} として書き出しました。</translation>
    </message>
</context>
<context>
    <name>panel.landmark_table</name>
    <message>
        <source>Landmark</source>
        <translation>ランドマーク</translation>
    </message>
    <message>
        <source>Error [mm]</source>
        <translation>誤差 [mm]</translation>
    </message>
    <message>
        <source>Error [px]</source>
        <translation>誤差 [px]</translation>
    </message>
    <message>
        <source>State</source>
        <translation>状態</translation>
    </message>
    <message>
        <source>only in the CT</source>
        <translation>CTのみ</translation>
    </message>
    <message>
        <source>only in the X-ray</source>
        <translation>X線画像のみ</translation>
    </message>
    <message>
        <source>not on the X-ray</source>
        <translation>X線画像の外</translation>
    </message>
    <message>
        <source>pending</source>
        <translation>保留中</translation>
    </message>
    <message>
        <source>used</source>
        <translation>使用</translation>
    </message>
    <message>
        <source>excluded: inconsistent with the others</source>
        <translation>除外: 他と整合しません</translation>
    </message>
</context>
<context>
    <name>panel.landmarks</name>
    <message>
        <source>Slicer has no main window to show the views in.</source>
        <translation>Slicerにビューを表示するメインウィンドウがありません。</translation>
    </message>
    <message>
        <source>{name}: landmarks in the CT</source>
        <translation>{name}: CTのランドマーク</translation>
    </message>
    <message>
        <source>{name}: landmarks in the X-ray</source>
        <translation>{name}: X線画像のランドマーク</translation>
    </message>
    <message>
        <source>projected landmarks</source>
        <translation>投影したランドマーク</translation>
    </message>
    <message>
        <source>Camera of {name} by landmarks</source>
        <translation>ランドマークによる {name} のカメラ</translation>
    </message>
    <message>
        <source>Only the first {count} X-rays can be shown: remove another one first.</source>
        <translation>表示できるX線画像は最初の {count} 枚だけです。先に別の画像を削除してください。</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is already used by another X-ray or by the CT: each X-ray needs a list of its own.</source>
        <translation>「{name}」はすでに別のX線画像またはCTで使われています。X線画像ごとに専用のリストが必要です。</translation>
    </message>
    <message>
        <source>{name}: pixels</source>
        <translation>{name}: ピクセル</translation>
    </message>
</context>
<context>
    <name>panel.maps</name>
    <message>
        <source>Computing...</source>
        <translation>計算しています...</translation>
    </message>
    <message>
        <source>nothing</source>
        <translation>なし</translation>
    </message>
    <message>
        <source>Black: &apos;{name}&apos; has no influence; yellow: only &apos;{name}&apos; has.</source>
        <translation>黒:「{name}」の影響なし、黄:「{name}」のみの影響。</translation>
    </message>
</context>
<context>
    <name>panel.motions</name>
    <message>
        <source>Displacement [mm]</source>
        <translation>変位 [mm]</translation>
    </message>
    <message>
        <source>Rotation [deg]</source>
        <translation>回転 [deg]</translation>
    </message>
    <message>
        <source>Right [mm]</source>
        <translation>右 [mm]</translation>
    </message>
    <message>
        <source>Anterior [mm]</source>
        <translation>前 [mm]</translation>
    </message>
    <message>
        <source>Superior [mm]</source>
        <translation>上 [mm]</translation>
    </message>
    <message>
        <source>Axis (R, A, S)</source>
        <translation>軸 (R, A, S)</translation>
    </message>
    <message>
        <source>Uncertainty</source>
        <translation>不確かさ</translation>
    </message>
    <message>
        <source>Doubts</source>
        <translation>疑問点</translation>
    </message>
    <message>
        <source>Structure</source>
        <translation>構造</translation>
    </message>
    <message>
        <source>Save motions</source>
        <translation>動きを保存</translation>
    </message>
    <message>
        <source>Tables (*.csv)</source>
        <translation>表 (*.csv)</translation>
    </message>
    <message>
        <source>the CT (absolute)</source>
        <translation>CT(絶対)</translation>
    </message>
    <message>
        <source>Relative to {name}</source>
        <translation>{name} に対する相対</translation>
    </message>
    <message>
        <source>{path} cannot be written ({reason}): choose another folder.</source>
        <translation>{path} に書き込めません({reason})。別のフォルダーを選択してください。</translation>
    </message>
</context>
<context>
    <name>panel.register</name>
    <message>
        <source>Register</source>
        <translation>位置合わせ</translation>
    </message>
    <message>
        <source>Preparing the data...</source>
        <translation>データを準備しています...</translation>
    </message>
    <message>
        <source>Reading the result...</source>
        <translation>結果を読み込んでいます...</translation>
    </message>
    <message>
        <source>Done in {seconds:.0f} s on {device}.</source>
        <translation>{device} で {seconds:.0f} 秒で完了しました。</translation>
    </message>
    <message>
        <source>PolyPose similarity</source>
        <translation>PolyPose 類似度</translation>
    </message>
    <message>
        <source>PolyPose similarity curve</source>
        <translation>PolyPose 類似度曲線</translation>
    </message>
    <message>
        <source>PolyPose similarity plot</source>
        <translation>PolyPose 類似度プロット</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>キャンセルしています...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>キャンセル</translation>
    </message>
    <message>
        <source>Stop the registration; nothing is changed.</source>
        <translation>位置合わせを中止します。何も変更されません。</translation>
    </message>
    <message>
        <source>Align the CT to the X-rays.</source>
        <translation>CTをX線画像に位置合わせします。</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>キャンセルしました。何も変更されていません。</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>開始しています...</translation>
    </message>
    <message>
        <source>this computer</source>
        <translation>このコンピューター</translation>
    </message>
    <message>
        <source>Ready: {bones} structures, {xrays} X-rays.</source>
        <translation>準備完了: 構造 {bones} 個、X線画像 {xrays} 枚。</translation>
    </message>
</context>
<context>
    <name>panel.report_page</name>
    <message>
        <source>PolyPose report</source>
        <translation>PolyPose レポート</translation>
    </message>
    <message>
        <source>Research software, not for clinical decisions.</source>
        <translation>研究用ソフトウェアです。臨床判断には使用できません。</translation>
    </message>
    <message>
        <source>Do not trust this result: {why}</source>
        <translation>この結果を信頼しないでください: {why}</translation>
    </message>
    <message>
        <source>X-rays and renderings</source>
        <translation>X線画像とレンダリング</translation>
    </message>
    <message>
        <source>Summary</source>
        <translation>概要</translation>
    </message>
    <message>
        <source>Motions of the bones</source>
        <translation>骨の動き</translation>
    </message>
</context>
<context>
    <name>panel.review</name>
    <message>
        <source>No result yet: register, or load an earlier result.</source>
        <translation>結果はまだありません。位置合わせを実行するか、以前の結果を読み込んでください。</translation>
    </message>
    <message>
        <source>all</source>
        <translation>すべて</translation>
    </message>
    <message>
        <source>Slicer has no main window to show the views in.</source>
        <translation>Slicerにビューを表示するメインウィンドウがありません。</translation>
    </message>
    <message>
        <source>Load a result folder</source>
        <translation>結果フォルダーを読み込む</translation>
    </message>
</context>
<context>
    <name>panel.saving</name>
    <message>
        <source>Save report</source>
        <translation>レポートを保存</translation>
    </message>
    <message>
        <source>HTML pages (*.html)</source>
        <translation>HTMLページ (*.html)</translation>
    </message>
    <message>
        <source>Save result as a scene</source>
        <translation>結果をシーンとして保存</translation>
    </message>
    <message>
        <source>Scenes (*.mrb)</source>
        <translation>シーン (*.mrb)</translation>
    </message>
    <message>
        <source>{voxels} voxels of {spacing} mm</source>
        <translation>{voxels} ボクセル、{spacing} mm</translation>
    </message>
    <message>
        <source>CT</source>
        <translation>CT</translation>
    </message>
    <message>
        <source>Structures</source>
        <translation>構造</translation>
    </message>
    <message>
        <source>Anchor</source>
        <translation>アンカー</translation>
    </message>
    <message>
        <source>Preset</source>
        <translation>プリセット</translation>
    </message>
    <message>
        <source>Computed on</source>
        <translation>計算装置</translation>
    </message>
    <message>
        <source>Computing time [s]</source>
        <translation>計算時間 [s]</translation>
    </message>
    <message>
        <source>X-ray</source>
        <translation>X線画像</translation>
    </message>
    <message>
        <source>rendering</source>
        <translation>レンダリング</translation>
    </message>
    <message>
        <source>edges</source>
        <translation>エッジ</translation>
    </message>
    <message>
        <source>{path} cannot be written ({reason}): choose another folder.</source>
        <translation>{path} に書き込めません({reason})。別のフォルダーを選択してください。</translation>
    </message>
    <message>
        <source>similarity {n:.4f}</source>
        <translation>類似度 {n:.4f}</translation>
    </message>
</context>
<context>
    <name>panel.segment_bones</name>
    <message>
        <source>starting</source>
        <translation>開始中</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>キャンセル中...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>キャンセル</translation>
    </message>
    <message>
        <source>Stop the segmentation; nothing is changed.</source>
        <translation>セグメンテーションを停止します。何も変更されません。</translation>
    </message>
    <message>
        <source>{name} could not segment the CT ({reason}): see the application&apos;s log.</source>
        <translation>{name} は CT をセグメント化できませんでした ({reason})：アプリケーションのログを確認してください。</translation>
    </message>
    <message>
        <source>Segment bones</source>
        <translation>骨をセグメント化</translation>
    </message>
    <message>
        <source>{name} ended with the code {code}: see the application&apos;s log.</source>
        <translation>{name} はコード {code} で終了しました：アプリケーションのログを確認してください。</translation>
    </message>
    <message>
        <source>{name} is installing what it needs...</source>
        <translation>{name} が必要なものをインストールしています...</translation>
    </message>
    <message>
        <source>The CT was deleted meanwhile: choose another.</source>
        <translation>CT がその間に削除されました：別の CT を選択してください。</translation>
    </message>
    <message>
        <source>{ct} bones</source>
        <translation>{ct} の骨</translation>
    </message>
    <message>
        <source>Segmented with {name}: check the bones and their structures.</source>
        <translation>{name} でセグメント化しました：骨とその構造を確認してください。</translation>
    </message>
    <message>
        <source>Segment the CT with the extension TotalSegmentator or MONAIAuto3DSeg, and propose the structures.</source>
        <translation>拡張機能 TotalSegmentator または MONAIAuto3DSeg で CT をセグメント化し、構造を提案します。</translation>
    </message>
    <message>
        <source>Choose the CT first.</source>
        <translation>まず CT を選択してください。</translation>
    </message>
    <message>
        <source>{name} found nothing in &apos;{ct}&apos;: is it a CT in Hounsfield units?</source>
        <translation>{name} は「{ct}」に何も見つけられませんでした：ハウンスフィールド単位の CT ですか？</translation>
    </message>
    <message>
        <source>&apos;{node}&apos; is ready; another CT is chosen by now.</source>
        <translation>「{node}」の準備ができましたが、現在は別の CT が選択されています。</translation>
    </message>
    <message>
        <source>{name}: {line}</source>
        <translation>{name}：{line}</translation>
    </message>
    <message>
        <source>The extension cannot be loaded ({reason}): update it.</source>
        <translation>拡張機能を読み込めません ({reason})：更新してください。</translation>
    </message>
</context>
<context>
    <name>panel.stage_words</name>
    <message>
        <source>Saving the result...</source>
        <translation>結果を保存しています...</translation>
    </message>
    <message>
        <source>Saving the track...</source>
        <translation>追跡を保存しています...</translation>
    </message>
    <message>
        <source>Tracking: {frame} of {of} frames</source>
        <translation>追跡: {frame} / {of} フレーム</translation>
    </message>
    <message>
        <source>Back: {frame} of {of} frames</source>
        <translation>逆方向: {frame} / {of} フレーム</translation>
    </message>
    <message>
        <source>Preparing the CT</source>
        <translation>CTを準備中</translation>
    </message>
    <message>
        <source>Fitting the bones</source>
        <translation>骨を合わせています</translation>
    </message>
    <message>
        <source>Looking for better places of bones</source>
        <translation>骨のより良い位置を探索中</translation>
    </message>
    <message>
        <source>Looking at united bones one by one</source>
        <translation>まとめられた骨を一つずつ確認中</translation>
    </message>
    <message>
        <source>Estimating the uncertainty</source>
        <translation>不確かさを推定中</translation>
    </message>
    <message>
        <source>Warping the CT</source>
        <translation>CTを変形中</translation>
    </message>
    <message>
        <source>Rendering the X-rays</source>
        <translation>X線画像をレンダリング中</translation>
    </message>
    <message>
        <source>{stage}: {iteration} of {of}</source>
        <translation>{stage}: {iteration} / {of}</translation>
    </message>
    <message>
        <source>about {minutes:.0f} min left in this pass</source>
        <translation>この回は残り約 {minutes:.0f} 分</translation>
    </message>
    <message>
        <source>, similarity {similarity:.4f}</source>
        <translation>、類似度 {similarity:.4f}</translation>
    </message>
    <message>
        <source>about {seconds:.0f} s left in this pass</source>
        <translation>この回は残り約 {seconds:.0f} 秒</translation>
    </message>
    <message>
        <source>Camera of {name}</source>
        <translation>{name} のカメラ</translation>
    </message>
</context>
<context>
    <name>panel.structures</name>
    <message>
        <source>No segment has the name of a bone, such as femur_left or &apos;Left femur&apos;: rename the segments, or type the structures into the table.</source>
        <translation>femur_left や &apos;Left femur&apos; のような骨の名前を持つセグメントがありません。セグメントの名前を変更するか、表に構造を入力してください。</translation>
    </message>
    <message>
        <source>Choose a CT and its segmentation; every bone needs a segment.</source>
        <translation>CTとそのセグメンテーションを選択してください。骨ごとにセグメントが必要です。</translation>
    </message>
    <message>
        <source>No segment is included yet: propose structures, or check segments in the table.</source>
        <translation>まだセグメントが含まれていません。構造を提案させるか、表でセグメントにチェックを入れてください。</translation>
    </message>
    <message>
        <source>Segment (moves)</source>
        <translation>セグメント(動く)</translation>
    </message>
    <message>
        <source>Structure</source>
        <translation>構造</translation>
    </message>
    <message>
        <source>Anchor</source>
        <translation>アンカー</translation>
    </message>
    <message>
        <source>Checked: this segment moves as a bone.</source>
        <translation>チェックあり: このセグメントは骨として動きます。</translation>
    </message>
    <message>
        <source>Moving relative to the anchor, &apos;{anchor}&apos;: {names}.</source>
        <translation>アンカー「{anchor}」に対して動くもの: {names}。</translation>
    </message>
    <message>
        <source>anchor</source>
        <translation>アンカー</translation>
    </message>
    <message>
        <source>{count} structures; now check the anchor, which stays where it is.</source>
        <translation>構造 {count} 個。次に、動かないアンカーを確認してください。</translation>
    </message>
    <message>
        <source>Only the anchor, &apos;{anchor}&apos;, is included: the cameras will be found, and no bone moves.</source>
        <translation>アンカー「{anchor}」だけが含まれています。カメラは探索されますが、骨は動きません。</translation>
    </message>
</context>
<context>
    <name>panel.track_review</name>
    <message>
        <source>forward and backward</source>
        <translation>前後両方向</translation>
    </message>
    <message>
        <source>forward</source>
        <translation>順方向</translation>
    </message>
    <message>
        <source>backward</source>
        <translation>逆方向</translation>
    </message>
    <message>
        <source>Saving the track...</source>
        <translation>追跡を保存しています...</translation>
    </message>
    <message>
        <source>Save the track into a folder</source>
        <translation>追跡をフォルダーに保存</translation>
    </message>
    <message>
        <source>A smoothed track cannot be continued: track without smoothing first.</source>
        <translation>平滑化した追跡は続行できません。まず平滑化せずに追跡してください。</translation>
    </message>
    <message>
        <source>{count} doubtful frames in this direction.</source>
        <translation>この方向に疑わしいフレームが {count} 個あります。</translation>
    </message>
    <message>
        <source>The scene has the poses alone: tables and plots of joints are left out.</source>
        <translation>シーンには姿勢だけがあります。関節の表とグラフは含まれません。</translation>
    </message>
    <message>
        <source>Corrections are not in it before you track on from them.</source>
        <translation>修正は、そこから追跡するまで含まれません。</translation>
    </message>
    <message>
        <source>Track anew from the bones of this frame, as you have corrected them; other frames are kept.</source>
        <translation>このフレームの骨（修正したとおり）から追跡し直します。他のフレームはそのまま残ります。</translation>
    </message>
    <message>
        <source>The track could not be written: {reason}</source>
        <translation>追跡を書き込めませんでした: {reason}</translation>
    </message>
    <message>
        <source>Written to {folder}.</source>
        <translation>{folder} に書き出しました。</translation>
    </message>
</context>
<context>
    <name>panel.track_words</name>
    <message>
        <source>Look at the outlines on the X-rays all the same.</source>
        <translation>それでも X線像の輪郭を確認してください。</translation>
    </message>
    <message>
        <source>What to do: correct a doubtful frame and track on from there, or give better cameras.</source>
        <translation>対処: 疑わしいフレームを修正してそこから追跡するか、より良いカメラを与えてください。</translation>
    </message>
    <message>
        <source>The checks found no sign of failure</source>
        <translation>チェックでは失敗の兆候は見つかりませんでした</translation>
    </message>
    <message>
        <source>{frames} frames are tracked, in {seconds:.0f} s.</source>
        <translation>{frames} フレームを {seconds:.0f} 秒で追跡しました。</translation>
    </message>
    <message>
        <source>DO NOT TRUST THIS TRACK</source>
        <translation>この追跡を信用しないでください</translation>
    </message>
    <message>
        <source>Check the doubtful frames before you use the track</source>
        <translation>追跡を使う前に疑わしいフレームを確認してください</translation>
    </message>
    <message>
        <source>{name}: {count} images; frame 0 is image {first}.</source>
        <translation>{name}: 画像 {count} 枚。フレーム 0 は画像 {first} です。</translation>
    </message>
    <message>
        <source>{name}: {doubtful} doubtful frames, lost in {lost} of them.</source>
        <translation>{name}: 疑わしいフレーム {doubtful} 個、うち見失ったもの {lost} 個。</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>警告: {text}</translation>
    </message>
    <message>
        <source>Frame {number}</source>
        <translation>フレーム {number}</translation>
    </message>
    <message>
        <source>Why: {why}</source>
        <translation>理由: {why}</translation>
    </message>
    <message>
        <source>Corrected by hand: {names}.</source>
        <translation>手で修正: {names}。</translation>
    </message>
    <message>
        <source>{name} was lost.</source>
        <translation>{name} を見失いました。</translation>
    </message>
    <message>
        <source>{name} is doubtful: {why}.</source>
        <translation>{name} は疑わしい: {why}。</translation>
    </message>
</context>
<context>
    <name>panel.tracking</name>
    <message>
        <source>Preparing the data...</source>
        <translation>データを準備しています...</translation>
    </message>
    <message>
        <source>Track</source>
        <translation>追跡する</translation>
    </message>
    <message>
        <source>Reading the track...</source>
        <translation>追跡を読み込んでいます...</translation>
    </message>
    <message>
        <source>Cancelling...</source>
        <translation>キャンセル中...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>キャンセル</translation>
    </message>
    <message>
        <source>Stop the tracking; frames that are done are kept.</source>
        <translation>追跡を止めます。終わったフレームは残ります。</translation>
    </message>
    <message>
        <source>Follow the bones through the sequences.</source>
        <translation>シーケンスを通して骨を追跡します。</translation>
    </message>
    <message>
        <source>{count} frames of an interrupted tracking are kept: Go on continues after them.

Begin anew all the same? They are removed once the new tracking has frames of its own.</source>
        <translation>中断された追跡の {count} フレームが保存されています。「続行」でその後から続けられます。

それでも最初からやり直しますか? 新しい追跡のフレームができた時点で削除されます。</translation>
    </message>
    <message>
        <source>Cancelled.</source>
        <translation>キャンセルしました。</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>キャンセルしました。何も変更されていません。</translation>
    </message>
    <message>
        <source>Starting...</source>
        <translation>開始しています...</translation>
    </message>
    <message>
        <source>The finished track is in {folder} until the scene is closed.</source>
        <translation>完成した追跡結果は、シーンを閉じるまで {folder} にあります。</translation>
    </message>
    <message>
        <source>{count} frames are kept: press Go on to continue after them, as long as the inputs stay as they are.</source>
        <translation>{count} フレームが残っています。入力が変わらない限り、「続行」でその続きから再開できます。</translation>
    </message>
    <message>
        <source>Ready: {bones} structures, {cameras} cameras, frames {first} to {last}, {rate:.4g} a second.</source>
        <translation>準備完了: 構造 {bones} 個、カメラ {cameras} 台、フレーム {first} ～ {last}、毎秒 {rate:.4g}。</translation>
    </message>
</context>
<context>
    <name>panel.undo</name>
    <message>
        <source>Redo</source>
        <translation>やり直す</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>元に戻す</translation>
    </message>
    <message>
        <source>Brings back what was there before the last registration.</source>
        <translation>最後の位置合わせの前の状態に戻します。</translation>
    </message>
    <message>
        <source>Bring back the result of the last registration.</source>
        <translation>最後の位置合わせの結果に戻します。</translation>
    </message>
    <message>
        <source>Take the result of the last registration out of the scene; Redo brings it back.</source>
        <translation>最後の位置合わせの結果をシーンから外します。「やり直す」で戻ります。</translation>
    </message>
    <message>
        <source>Bring back the result that was there before the last registration.</source>
        <translation>最後の位置合わせの前にあった結果に戻します。</translation>
    </message>
</context>
<context>
    <name>panel.verdict</name>
    <message>
        <source>Look at the overlay of each X-ray all the same.</source>
        <translation>それでも各X線画像の重ね合わせを確認してください。</translation>
    </message>
    <message>
        <source>What to do: look at the overlay of each X-ray; where it does not match, give a better initial camera or landmarks, and register again.</source>
        <translation>対処: 各X線画像の重ね合わせを確認し、合っていない場合はより良い初期カメラまたはランドマークを与えて、再度位置合わせしてください。</translation>
    </message>
    <message>
        <source>The checks found no sign of failure</source>
        <translation>チェックでは失敗の兆候は見つかりませんでした</translation>
    </message>
    <message>
        <source>DO NOT TRUST THIS RESULT</source>
        <translation>この結果を信頼しないでください</translation>
    </message>
    <message>
        <source>Check what is named here before you use the result</source>
        <translation>結果を使用する前に、ここに挙げた点を確認してください</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>警告: {text}</translation>
    </message>
    <message>
        <source>Why: {why}</source>
        <translation>理由: {why}</translation>
    </message>
</context>
<context>
    <name>panel.xray_details</name>
    <message>
        <source>as in the file</source>
        <translation>ファイルのとおり</translation>
    </message>
    <message>
        <source>&apos;{text}&apos; is not a number: use digits and a decimal point, or leave the field empty.</source>
        <translation>「{text}」は数値ではありません。数字と小数点を使うか、空欄にしてください。</translation>
    </message>
</context>
<context>
    <name>panel.xray_drop</name>
    <message>
        <source>drop image files, or loaded X-rays (a volume, a sequence, or a folder of them) from a tree of the data</source>
        <translation>画像ファイル、またはデータツリーから読み込み済みの X線画像（ボリューム、シーケンス、またはそのフォルダ）をドロップしてください</translation>
    </message>
    <message>
        <source>No X-ray: {names}; {can}.</source>
        <translation>X線画像ではありません：{names}。{can}。</translation>
    </message>
    <message>
        <source>Nothing here is an X-ray: {can}.</source>
        <translation>X線画像が含まれていません：{can}。</translation>
    </message>
    <message>
        <source>{names} and {count} more</source>
        <translation>{names} ほか {count} 件</translation>
    </message>
</context>
<context>
    <name>panel.xrays</name>
    <message>
        <source>Add two or more X-rays from different directions.</source>
        <translation>方向の異なるX線画像を2枚以上追加してください。</translation>
    </message>
    <message>
        <source>X-ray</source>
        <translation>X線画像</translation>
    </message>
    <message>
        <source>Geometry from</source>
        <translation>ジオメトリの出所</translation>
    </message>
    <message>
        <source>Camera</source>
        <translation>カメラ</translation>
    </message>
    <message>
        <source>State</source>
        <translation>状態</translation>
    </message>
    <message>
        <source>X-rays</source>
        <translation>X線画像</translation>
    </message>
    <message>
        <source>All files</source>
        <translation>すべてのファイル</translation>
    </message>
    <message>
        <source>Read geometry</source>
        <translation>ジオメトリを読み込む</translation>
    </message>
    <message>
        <source>Study files (*.json)</source>
        <translation>スタディファイル (*.json)</translation>
    </message>
    <message>
        <source>What was dropped is in the table already.</source>
        <translation>ドロップされたものはすでに表にあります。</translation>
    </message>
    <message>
        <source>Add X-rays</source>
        <translation>X線画像を追加</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is not ready: complete its geometry, or remove it.</source>
        <translation>X線画像「{name}」は準備ができていません。ジオメトリを入力するか、削除してください。</translation>
    </message>
</context>
<context>
    <name>process.camera_run</name>
    <message>
        <source>search</source>
        <translation>探索</translation>
    </message>
    <message>
        <source>The result of the search cannot be read: search again.</source>
        <translation>探索結果を読み込めません。もう一度探索してください。</translation>
    </message>
</context>
<context>
    <name>process.dependencies</name>
    <message>
        <source>PyTorch is missing, and nothing is installed while testing.</source>
        <translation>PyTorchがありません。テスト中は何もインストールしません。</translation>
    </message>
    <message>
        <source>PyTorch was not installed: PolyPose cannot register without it.</source>
        <translation>PyTorchがインストールされませんでした。PyTorchなしではPolyPoseは位置合わせできません。</translation>
    </message>
    <message>
        <source>PyTorch is missing: install the extension PyTorch in the Extensions Manager and restart Slicer.</source>
        <translation>PyTorchがありません。拡張機能マネージャーで拡張機能PyTorchをインストールし、Slicerを再起動してください。</translation>
    </message>
    <message>
        <source>The Python packages that PolyPose needs were not installed ({reason}): try again.</source>
        <translation>PolyPoseに必要なPythonパッケージがインストールされませんでした({reason})。もう一度試してください。</translation>
    </message>
    <message>
        <source>PyTorch could not be installed ({reason}): install it in the module PyTorch Utils.</source>
        <translation>PyTorchをインストールできませんでした({reason})。モジュール PyTorch Utils でインストールしてください。</translation>
    </message>
</context>
<context>
    <name>process.dicom_export</name>
    <message>
        <source>DICOM export</source>
        <translation>DICOM書き出し</translation>
    </message>
</context>
<context>
    <name>process.environment</name>
    <message>
        <source>PolyPose needs 3D Slicer {needed} or newer, and this is {found}: install the current stable version.</source>
        <translation>PolyPoseには3D Slicer {needed} 以降が必要ですが、これは {found} です。最新の安定版をインストールしてください。</translation>
    </message>
</context>
<context>
    <name>process.extensions</name>
    <message>
        <source>Bones are segmented by the extension TotalSegmentator or MONAIAuto3DSeg: install one in the Extensions Manager and restart Slicer.</source>
        <translation>骨は拡張機能 TotalSegmentator または MONAIAuto3DSeg でセグメント化されます：Extensions Manager でどちらかをインストールし、Slicer を再起動してください。</translation>
    </message>
    <message>
        <source>Bones are segmented by an extension, and neither TotalSegmentator nor MONAIAuto3DSeg is installed.

Install {name} now, with the extensions that it needs? It is downloaded from Slicer&apos;s extensions server.</source>
        <translation>骨は拡張機能でセグメント化されますが、TotalSegmentator も MONAIAuto3DSeg もインストールされていません。

{name} を、必要な拡張機能とともに今インストールしますか？Slicer の拡張機能サーバーからダウンロードされます。</translation>
    </message>
    <message>
        <source>{name} was installed: save your data and restart Slicer.</source>
        <translation>{name} がインストールされました：データを保存して Slicer を再起動してください。</translation>
    </message>
    <message>
        <source>The extension {name} is installed, but its module is not loaded: restart Slicer, or enable it in the Extensions Manager.</source>
        <translation>拡張機能 {name} はインストールされていますが、モジュールが読み込まれていません：Slicer を再起動するか、Extensions Manager で有効にしてください。</translation>
    </message>
    <message>
        <source>The extension {name} could not be installed: check the network connection, or install it in the Extensions Manager.</source>
        <translation>拡張機能 {name} をインストールできませんでした：ネットワーク接続を確認するか、Extensions Manager でインストールしてください。</translation>
    </message>
    <message>
        <source>{name} was installed. Slicer must be restarted before it can be used; data that were not saved are lost. Restart now?</source>
        <translation>{name} がインストールされました。使用する前に Slicer の再起動が必要です。保存されていないデータは失われます。今すぐ再起動しますか？</translation>
    </message>
</context>
<context>
    <name>process.monai_auto3dseg</name>
    <message>
        <source>MONAIAuto3DSeg offers no model of bones: update the extension.</source>
        <translation>MONAIAuto3DSeg に骨のモデルがありません：拡張機能を更新してください。</translation>
    </message>
    <message>
        <source>computing</source>
        <translation>計算中</translation>
    </message>
    <message>
        <source>MONAIAuto3DSeg ended with the code {code}: see the application&apos;s log.</source>
        <translation>MONAIAuto3DSeg はコード {code} で終了しました：アプリケーションのログを確認してください。</translation>
    </message>
    <message>
        <source>MONAIAuto3DSeg&apos;s result could not be read: see the application&apos;s log.</source>
        <translation>MONAIAuto3DSeg の結果を読み込めませんでした：アプリケーションのログを確認してください。</translation>
    </message>
    <message>
        <source>reading the result</source>
        <translation>結果を読み込み中</translation>
    </message>
</context>
<context>
    <name>process.registration</name>
    <message>
        <source>registration</source>
        <translation>位置合わせ</translation>
    </message>
    <message>
        <source>The result must not be trusted: {reasons}.</source>
        <translation>この結果は信頼できません: {reasons}。</translation>
    </message>
    <message>
        <source>{name} transform</source>
        <translation>{name} の変換</translation>
    </message>
</context>
<context>
    <name>process.render_client</name>
    <message>
        <source>The CT cannot be rendered ({reason}): choose the CT again to retry.</source>
        <translation>CTをレンダリングできません({reason})。CTを選択し直してもう一度試してください。</translation>
    </message>
    <message>
        <source>its process ended</source>
        <translation>プロセスが終了しました</translation>
    </message>
    <message>
        <source>The rendering cannot be read: {reason}.</source>
        <translation>レンダリングを読み込めません: {reason}。</translation>
    </message>
</context>
<context>
    <name>process.segmentation_task</name>
    <message>
        <source>The segmentation was cancelled; nothing was changed.</source>
        <translation>セグメンテーションはキャンセルされました。何も変更されていません。</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; was deleted while the CT was segmented: start the segmentation again.</source>
        <translation>CT のセグメント化中に「{name}」が削除されました：セグメンテーションをやり直してください。</translation>
    </message>
</context>
<context>
    <name>process.study_run</name>
    <message>
        <source>registration</source>
        <translation>位置合わせ</translation>
    </message>
    <message>
        <source>a crash</source>
        <translation>クラッシュ</translation>
    </message>
    <message>
        <source>Memory ran out: crop the CT or use a coarser one.</source>
        <translation>メモリが不足しました。CTをクロップするか、より粗いCTを使用してください。</translation>
    </message>
    <message>
        <source>The {what} ended without a result (exit status {status}).</source>
        <translation>{what}は結果を出さずに終了しました(終了ステータス {status})。</translation>
    </message>
    <message>
        <source>signal {number}</source>
        <translation>シグナル {number}</translation>
    </message>
    <message>
        <source>The {what} was cancelled.</source>
        <translation>{what}はキャンセルされました。</translation>
    </message>
    <message>
        <source>The {what} was interrupted from outside.</source>
        <translation>{what}は外部から中断されました。</translation>
    </message>
    <message>
        <source>The {what}&apos;s process was ended by the system ({end}), most often because memory ran out: use the fast preset, or crop the CT.</source>
        <translation>{what}のプロセスがシステムによって終了されました({end})。多くの場合メモリ不足が原因です。高速プリセットを使うか、CTをクロップしてください。</translation>
    </message>
    <message>
        <source>The Python package &apos;{name}&apos; is missing: let PolyPose install what it needs.</source>
        <translation>Pythonパッケージ「{name}」がありません。PolyPoseに必要なものをインストールさせてください。</translation>
    </message>
    <message>
        <source>The {what} rejected its input without giving a reason.</source>
        <translation>{what}は理由を示さずに入力を拒否しました。</translation>
    </message>
    <message>
        <source>{program} could not be started ({reason}): install Slicer again.</source>
        <translation>{program} を起動できませんでした({reason})。Slicerを再インストールしてください。</translation>
    </message>
    <message>
        <source>An unexpected error occurred: {fault}.</source>
        <translation>予期しないエラーが発生しました: {fault}。</translation>
    </message>
</context>
<context>
    <name>process.track_run</name>
    <message>
        <source>tracking</source>
        <translation>追跡</translation>
    </message>
    <message>
        <source>The track must not be trusted: {reasons}.</source>
        <translation>この追跡結果は信頼できません: {reasons}。</translation>
    </message>
</context>
<context>
    <name>scene.bone_handles</name>
    <message>
        <source>Adjustment of {name}</source>
        <translation>{name} の調整</translation>
    </message>
    <message>
        <source>{name}, adjusted</source>
        <translation>{name}(調整済み)</translation>
    </message>
    <message>
        <source>Outline of {name}</source>
        <translation>{name} の輪郭</translation>
    </message>
</context>
<context>
    <name>scene.bone_models</name>
    <message>
        <source>Motion of {name}</source>
        <translation>{name} の動き</translation>
    </message>
    <message>
        <source>{name} in 3D</source>
        <translation>{name}（3D）</translation>
    </message>
</context>
<context>
    <name>scene.cameras</name>
    <message>
        <source>The camera &apos;{name}&apos; is not a linear transform: choose one that is.</source>
        <translation>カメラ「{name}」は線形変換ではありません。線形変換を選択してください。</translation>
    </message>
</context>
<context>
    <name>scene.carried_nodes</name>
    <message>
        <source>{name} carried along</source>
        <translation>{name} 追従</translation>
    </message>
</context>
<context>
    <name>scene.carried_points</name>
    <message>
        <source>{name} as X-rayed</source>
        <translation>{name} X線撮影時</translation>
    </message>
</context>
<context>
    <name>scene.deformation</name>
    <message>
        <source>PolyPose volume change</source>
        <translation>PolyPose 体積変化</translation>
    </message>
    <message>
        <source>PolyPose volume change colours</source>
        <translation>PolyPose 体積変化の色</translation>
    </message>
    <message>
        <source>PolyPose weight</source>
        <translation>PolyPose 重み</translation>
    </message>
    <message>
        <source>PolyPose weight colours</source>
        <translation>PolyPose 重みの色</translation>
    </message>
    <message>
        <source>Volume changes by a factor of {low:.2f} to {high:.2f} (99 % of the grid).</source>
        <translation>体積は {low:.2f} 倍から {high:.2f} 倍に変化します(グリッドの 99 %)。</translation>
    </message>
    <message>
        <source>The deformation folds in {share:.2f} % of the grid (magenta): do not trust the soft tissue there.</source>
        <translation>変形はグリッドの {share:.2f} % で折り重なっています(マゼンタ)。そこの軟部組織は信頼しないでください。</translation>
    </message>
    <message>
        <source>PolyPose weight of {name}</source>
        <translation>{name} の PolyPose 重み</translation>
    </message>
    <message>
        <source>No folds.</source>
        <translation>折り重なりはありません。</translation>
    </message>
    <message>
        <source>There is no structure &apos;{name}&apos;: choose one from the table.</source>
        <translation>構造「{name}」はありません。表から選択してください。</translation>
    </message>
</context>
<context>
    <name>scene.ellipsoids</name>
    <message>
        <source>95 % ellipsoids of carried points</source>
        <translation>追従点の95 %楕円体</translation>
    </message>
</context>
<context>
    <name>scene.grid_transform</name>
    <message>
        <source>&apos;{node}&apos; does not hold a displacement grid: register first, or load a result.</source>
        <translation>「{node}」には変位グリッドがありません。先に位置合わせするか、結果を読み込んでください。</translation>
    </message>
</context>
<context>
    <name>scene.motions</name>
    <message>
        <source>Structure</source>
        <translation>構造</translation>
    </message>
    <message>
        <source>Rotation [deg]</source>
        <translation>回転 [deg]</translation>
    </message>
    <message>
        <source>Displacement [mm]</source>
        <translation>変位 [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % along the beam [mm]</source>
        <translation>{percent:.0f} % ビーム方向 [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % across the beam [mm]</source>
        <translation>{percent:.0f} % ビームに直交 [mm]</translation>
    </message>
    <message>
        <source>{percent:.0f} % about the beam [deg]</source>
        <translation>{percent:.0f} % ビームまわり [deg]</translation>
    </message>
    <message>
        <source>{percent:.0f} % across the beam [deg]</source>
        <translation>{percent:.0f} % ビームに直交 [deg]</translation>
    </message>
    <message>
        <source>Right [mm]</source>
        <translation>右 [mm]</translation>
    </message>
    <message>
        <source>Anterior [mm]</source>
        <translation>前 [mm]</translation>
    </message>
    <message>
        <source>Superior [mm]</source>
        <translation>上 [mm]</translation>
    </message>
    <message>
        <source>Axis R</source>
        <translation>軸 R</translation>
    </message>
    <message>
        <source>Axis A</source>
        <translation>軸 A</translation>
    </message>
    <message>
        <source>Axis S</source>
        <translation>軸 S</translation>
    </message>
    <message>
        <source>Doubts</source>
        <translation>疑問点</translation>
    </message>
</context>
<context>
    <name>scene.nodes</name>
    <message>
        <source>The volume &apos;{name}&apos; has no voxels: load it again.</source>
        <translation>ボリューム「{name}」にボクセルがありません。読み込み直してください。</translation>
    </message>
    <message>
        <source>The segmentation &apos;{name}&apos; has no segment &apos;{segment}&apos;.</source>
        <translation>セグメンテーション「{name}」にセグメント「{segment}」がありません。</translation>
    </message>
    <message>
        <source>The segmentation &apos;{name}&apos; cannot be converted to label maps.</source>
        <translation>セグメンテーション「{name}」をラベルマップに変換できません。</translation>
    </message>
</context>
<context>
    <name>scene.track_charts</name>
    <message>
        <source>angle [deg]</source>
        <translation>角度 [deg]</translation>
    </message>
    <message>
        <source>translation [mm]</source>
        <translation>並進 [mm]</translation>
    </message>
    <message>
        <source>time [s]</source>
        <translation>時間 [s]</translation>
    </message>
    <message>
        <source>{joint} angles</source>
        <translation>{joint}: 角度</translation>
    </message>
    <message>
        <source>{joint} angles, doubtful</source>
        <translation>{joint}: 角度、不確か</translation>
    </message>
    <message>
        <source>{joint} angles, this frame</source>
        <translation>{joint}: 角度、現在のフレーム</translation>
    </message>
    <message>
        <source>{joint} translations</source>
        <translation>{joint}: 並進</translation>
    </message>
    <message>
        <source>{joint} translations, doubtful</source>
        <translation>{joint}: 並進、不確か</translation>
    </message>
    <message>
        <source>{joint} translations, this frame</source>
        <translation>{joint}: 並進、現在のフレーム</translation>
    </message>
    <message>
        <source>{title}, values</source>
        <translation>{title}、値</translation>
    </message>
    <message>
        <source>{title}, intervals</source>
        <translation>{title}、区間</translation>
    </message>
    <message>
        <source>{quantity}, 95 %</source>
        <translation>{quantity}、95 %</translation>
    </message>
    <message>
        <source>{title}, cursor</source>
        <translation>{title}、カーソル</translation>
    </message>
    <message>
        <source>{title}, doubtful frames</source>
        <translation>{title}、不確かなフレーム</translation>
    </message>
</context>
<context>
    <name>scene.track_outlines</name>
    <message>
        <source>Outline of {bone} on {xray}</source>
        <translation>{xray} 上の {bone} の輪郭</translation>
    </message>
</context>
<context>
    <name>scene.track_sequences</name>
    <message>
        <source>&apos;{name}&apos; holds no images: choose a sequence of X-rays, or a volume.</source>
        <translation>「{name}」には画像がありません。X線画像のシーケンスまたはボリュームを選択してください。</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is not an image: choose a volume or a sequence of volumes.</source>
        <translation>「{name}」は画像ではありません。ボリュームまたはボリュームのシーケンスを選択してください。</translation>
    </message>
</context>
<context>
    <name>scene.xray_views</name>
    <message>
        <source>View of {name}</source>
        <translation>{name} のビュー</translation>
    </message>
    <message>
        <source>C-arm of {name}</source>
        <translation>{name} のCアーム</translation>
    </message>
    <message>
        <source>Detector of {name}</source>
        <translation>{name} の検出器</translation>
    </message>
</context>
<context>
    <name>study.camera_source</name>
    <message>
        <source>automatic: the best available</source>
        <translation>自動: 利用できる最良のもの</translation>
    </message>
    <message>
        <source>C-arm placed by hand</source>
        <translation>手動で配置したCアーム</translation>
    </message>
    <message>
        <source>DICOM angles</source>
        <translation>DICOMの角度</translation>
    </message>
    <message>
        <source>landmarks</source>
        <translation>ランドマーク</translation>
    </message>
    <message>
        <source>search</source>
        <translation>探索</translation>
    </message>
    <message>
        <source>model trained on this CT</source>
        <translation>このCTで学習したモデル</translation>
    </message>
    <message>
        <source>calibrated camera</source>
        <translation>キャリブレーション済みカメラ</translation>
    </message>
</context>
<context>
    <name>study.carried_points</name>
    <message>
        <source>Points moved by the bone in which they lie: {count}.</source>
        <translation>骨の中にあり、その骨と動く点：{count}。</translation>
    </message>
    <message>
        <source>Points moved by the displacement field: {count}.</source>
        <translation>変位場で動く点：{count}。</translation>
    </message>
    <message>
        <source>Points outside of the result&apos;s grid, which are only roughly right: {count}.</source>
        <translation>結果のグリッドの外にあり、おおよその位置である点：{count}。</translation>
    </message>
    <message>
        <source>The longest half axes of the 95 % ellipsoids: {least:.1f} to {most:.1f} mm.</source>
        <translation>95 %楕円体の最長の半軸：{least:.1f}～{most:.1f} mm。</translation>
    </message>
    <message>
        <source>Points whose uncertainty is not known: {count}.</source>
        <translation>不確かさが分からない点：{count}。</translation>
    </message>
</context>
<context>
    <name>study.field_words</name>
    <message>
        <source>set &quot;{field}&quot; to &quot;{choice}&quot;</source>
        <translation>「{field}」を「{choice}」に設定してください</translation>
    </message>
    <message>
        <source>Source to detector</source>
        <translation>線源-検出器間距離</translation>
    </message>
    <message>
        <source>Source to isocentre</source>
        <translation>線源-アイソセンター間距離</translation>
    </message>
    <message>
        <source>Pixel spacing</source>
        <translation>ピクセル間隔</translation>
    </message>
    <message>
        <source>Principal point</source>
        <translation>主点</translation>
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
        <translation>アイソセンター</translation>
    </message>
    <message>
        <source>Patient position</source>
        <translation>患者体位</translation>
    </message>
    <message>
        <source>Search near</source>
        <translation>探索の中心</translation>
    </message>
    <message>
        <source>Camera pose</source>
        <translation>カメラの位置姿勢</translation>
    </message>
    <message>
        <source>Image seen from</source>
        <translation>画像を見る側</translation>
    </message>
    <message>
        <source>the source</source>
        <translation>線源</translation>
    </message>
    <message>
        <source>Distortion</source>
        <translation>歪み</translation>
    </message>
    <message>
        <source>corrected</source>
        <translation>補正済み</translation>
    </message>
</context>
<context>
    <name>study.landmark_fit</name>
    <message>
        <source>The landmarks</source>
        <translation>ランドマーク</translation>
    </message>
    <message>
        <source>Only in the CT: {names}.</source>
        <translation>CTのみ: {names}。</translation>
    </message>
    <message>
        <source>Only in the X-ray: {names}.</source>
        <translation>X線画像のみ: {names}。</translation>
    </message>
    <message>
        <source>Not on the X-ray: {names}; pick them in the X-ray&apos;s own view.</source>
        <translation>X線画像の外: {names}。X線画像専用のビューで配置してください。</translation>
    </message>
    <message>
        <source>{used} of {count} landmarks used, RMS error {rms:.1f} mm; expected accuracy of the camera: {degrees:.1f} deg and {mm:.0f} mm.</source>
        <translation>ランドマーク {count} 個中 {used} 個を使用、RMS誤差 {rms:.1f} mm。カメラの予想精度: {degrees:.1f}°、{mm:.0f} mm。</translation>
    </message>
    <message>
        <source>Uncertain: {why}.</source>
        <translation>不確実: {why}。</translation>
    </message>
    <message>
        <source>{count} of at least {fewest} pairs: pick {missing} more, on the anchor.</source>
        <translation>{count} 組(少なくとも {fewest} 組必要): アンカー上にあと {missing} 組配置してください。</translation>
    </message>
</context>
<context>
    <name>study.parameters</name>
    <message>
        <source>Choose the CT.</source>
        <translation>CTを選択してください。</translation>
    </message>
    <message>
        <source>Choose the segmentation of the CT&apos;s bones.</source>
        <translation>CTの骨のセグメンテーションを選択してください。</translation>
    </message>
    <message>
        <source>Assign at least one segment to a structure, or have the structures proposed.</source>
        <translation>少なくとも1つのセグメントを構造に割り当てるか、構造を提案させてください。</translation>
    </message>
    <message>
        <source>Choose the anchor: the structure that stays where it is.</source>
        <translation>アンカー(動かない構造)を選択してください。</translation>
    </message>
    <message>
        <source>Add an X-ray; two or more from different directions are better.</source>
        <translation>X線画像を追加してください。方向の異なる2枚以上が望ましいです。</translation>
    </message>
    <message>
        <source>Default</source>
        <translation>標準</translation>
    </message>
    <message>
        <source>Fast (for a first look)</source>
        <translation>高速(最初の確認用)</translation>
    </message>
    <message>
        <source>Paper (the published settings)</source>
        <translation>論文(公表された設定)</translation>
    </message>
    <message>
        <source>Automatic</source>
        <translation>自動</translation>
    </message>
    <message>
        <source>Processor (CPU)</source>
        <translation>プロセッサー(CPU)</translation>
    </message>
    <message>
        <source>Graphics card (GPU, CUDA)</source>
        <translation>グラフィックカード(GPU, CUDA)</translation>
    </message>
    <message>
        <source>The rig &quot;{name}&quot; has only one X-ray: enter it for another X-ray as well, or clear it.</source>
        <translation>リグ「{name}」のX線画像は1枚だけです。別のX線画像にも入力するか、消去してください。</translation>
    </message>
</context>
<context>
    <name>study.reader</name>
    <message>
        <source>{path}: there is no such file; correct the study.</source>
        <translation>{path}: このファイルはありません。スタディを修正してください。</translation>
    </message>
</context>
<context>
    <name>study.result_scene</name>
    <message>
        <source>{path} cannot be written: choose another folder.</source>
        <translation>{path} に書き込めません。別のフォルダーを選択してください。</translation>
    </message>
</context>
<context>
    <name>study.results</name>
    <message>
        <source>{name} transform</source>
        <translation>{name} の変換</translation>
    </message>
    <message>
        <source>{name} warped CT</source>
        <translation>{name} の変形したCT</translation>
    </message>
    <message>
        <source>{name} warped segmentation</source>
        <translation>{name} の変形したセグメンテーション</translation>
    </message>
    <message>
        <source>{name} motions</source>
        <translation>{name} の動き</translation>
    </message>
    <message>
        <source>{name} similarity</source>
        <translation>{name} の類似度</translation>
    </message>
    <message>
        <source>{name} similarity curve</source>
        <translation>{name} の類似度曲線</translation>
    </message>
    <message>
        <source>{name} similarity plot</source>
        <translation>{name} の類似度プロット</translation>
    </message>
    <message>
        <source>Similarity</source>
        <translation>類似度</translation>
    </message>
    <message>
        <source>Iteration</source>
        <translation>反復</translation>
    </message>
    <message>
        <source>Label {number}</source>
        <translation>ラベル {number}</translation>
    </message>
    <message>
        <source>view {number}</source>
        <translation>ビュー {number}</translation>
    </message>
</context>
<context>
    <name>study.scene_result</name>
    <message>
        <source>No result yet: register, or load an earlier result.</source>
        <translation>結果はまだありません。位置合わせを実行するか、以前の結果を読み込んでください。</translation>
    </message>
    <message>
        <source>The result has lost its table of motions: register again, or load the result again.</source>
        <translation>結果の動きの表がありません。もう一度位置合わせするか、結果を読み込み直してください。</translation>
    </message>
    <message>
        <source>Choose the CT of the result.</source>
        <translation>結果のCTを選択してください。</translation>
    </message>
    <message>
        <source>Choose the segmentation of the result&apos;s bones: it says where they are.</source>
        <translation>結果の骨のセグメンテーションを選択してください。骨の位置を示します。</translation>
    </message>
    <message>
        <source>The result has lost its warped CT or segmentation: register again, or load the result again.</source>
        <translation>結果の変形したCTまたはセグメンテーションがありません。もう一度位置合わせするか、結果を読み込み直してください。</translation>
    </message>
    <message>
        <source>The result&apos;s structure &apos;{name}&apos; has no segment: assign it in the first section.</source>
        <translation>結果の構造「{name}」にセグメントがありません。最初のセクションで割り当ててください。</translation>
    </message>
</context>
<context>
    <name>study.track_images</name>
    <message>
        <source>{camera} frames</source>
        <translation>{camera}: フレーム</translation>
    </message>
    <message>
        <source>{camera} X-ray</source>
        <translation>{camera}: X線画像</translation>
    </message>
</context>
<context>
    <name>study.track_plan</name>
    <message>
        <source>The camera of &apos;{name}&apos; is not known: register one frame of all sequences first, whose cameras are then kept, or state that the camera is known exactly.</source>
        <translation>&apos;{name}&apos; のカメラが分かりません。まず全シーケンスの 1 フレームを位置合わせしてください（そのカメラを引き継ぎます）。または、カメラが正確に分かっていることを指定してください。</translation>
    </message>
    <message>
        <source>The images do not state how many frames there are in a second: enter it.</source>
        <translation>画像に毎秒のフレーム数がありません。入力してください。</translation>
    </message>
    <message>
        <source>No frame is left: there are {count}, counted from 0. Check the first and the last frame.</source>
        <translation>フレームが残っていません。全部で {count} 個です（0 から数えます）。最初と最後のフレームを確認してください。</translation>
    </message>
    <message>
        <source>Choose the bones first</source>
        <translation>まず骨を選択</translation>
    </message>
    <message>
        <source>Two X-rays have the name &quot;{name}&quot;: give each camera its own.</source>
        <translation>2 つの X線像の名前が &quot;{name}&quot; です。カメラごとに別の名前を付けてください。</translation>
    </message>
    <message>
        <source>Find the cameras first</source>
        <translation>まずカメラを決定</translation>
    </message>
    <message>
        <source>Enter the frame rate</source>
        <translation>フレームレートを入力</translation>
    </message>
    <message>
        <source>No frame is left that every camera has: check which image each X-ray shows (Frame).</source>
        <translation>すべてのカメラにあるフレームが残っていません。各 X線像に表示されている画像（フレーム）を確認してください。</translation>
    </message>
    <message>
        <source>Check the frames</source>
        <translation>フレームを確認</translation>
    </message>
    <message>
        <source>Register one frame first</source>
        <translation>まず 1 フレームを位置合わせ</translation>
    </message>
    <message>
        <source>There is no result to start from: register one frame, or choose another start.</source>
        <translation>開始に使う結果がありません。1 フレームを位置合わせするか、別の開始方法を選んでください。</translation>
    </message>
    <message>
        <source>Choose the CT.</source>
        <translation>CTを選択してください。</translation>
    </message>
    <message>
        <source>Choose the segmentation of the CT&apos;s bones.</source>
        <translation>CTの骨のセグメンテーションを選択してください。</translation>
    </message>
    <message>
        <source>Assign at least one segment to a structure, or have the structures proposed.</source>
        <translation>少なくとも1つのセグメントを構造に割り当てるか、構造を提案させてください。</translation>
    </message>
    <message>
        <source>Choose the reference: the structure relative to which motions are reported.</source>
        <translation>基準（動きを示す基準となる構造）を選択してください。</translation>
    </message>
    <message>
        <source>Let a bone move</source>
        <translation>動く骨を 1 つ以上に</translation>
    </message>
    <message>
        <source>Every structure stands still: uncheck those that move in the sequence.</source>
        <translation>すべての構造が静止しています。シーケンス中に動くもののチェックを外してください。</translation>
    </message>
    <message>
        <source>Add an X-ray sequence first</source>
        <translation>まずシーケンスを追加</translation>
    </message>
    <message>
        <source>None of the X-rays is a sequence: add one for each camera in the section X-rays.</source>
        <translation>X線像の中にシーケンスがありません。「X線像」のセクションでカメラごとに 1 つ追加してください。</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is not ready: complete its geometry, or remove it.</source>
        <translation>X線画像「{name}」は準備ができていません。ジオメトリを入力するか、削除してください。</translation>
    </message>
    <message>
        <source>Name the X-rays first</source>
        <translation>まず X線像に名前を付ける</translation>
    </message>
    <message>
        <source>One camera shows next to nothing of motion along its rays: two are better.</source>
        <translation>1 台のカメラでは、線束に沿った動きはほとんど分かりません。2 台の方が良いです。</translation>
    </message>
    <message>
        <source>Complete the X-rays first</source>
        <translation>まず X線像を完成</translation>
    </message>
    <message>
        <source>The sequences state different numbers of frames per second ({rates}): enter the true one.</source>
        <translation>シーケンスが示す毎秒のフレーム数が異なります（{rates}）。正しい値を入力してください。</translation>
    </message>
    <message>
        <source>The result&apos;s poses of structures that stand still are flagged as uncertain ({names}), but the track takes them as exact and flags nothing: let them move, or correct them and register again.</source>
        <translation>静止している構造の結果の姿勢が不確かと判定されています ({names})。追跡ではそれらを正確なものとして扱い、何も警告しません。動くものとして扱うか、修正して再度位置合わせしてください。</translation>
    </message>
    <message>
        <source>{count} X-rays are single images and are not tracked.</source>
        <translation>{count} 枚の X線像は単独の画像なので追跡しません。</translation>
    </message>
    <message>
        <source>The sequences have different numbers of images from frame 0 on ({each}): what one of them lacks is not tracked.</source>
        <translation>フレーム 0 以降の画像数がシーケンスごとに異なります（{each}）。どれかに欠けているものは追跡しません。</translation>
    </message>
    <message>
        <source>The images state {rate:.4g} frames per second, another number than was entered.</source>
        <translation>画像は毎秒 {rate:.4g} フレームを示しており、入力された値と異なります。</translation>
    </message>
    <message>
        <source>{name}: by their times, images are missing after image {number}; frames are taken as evenly spaced.</source>
        <translation>{name}：時刻によると画像 {number} の後に画像が欠けています。フレームは等間隔とみなされます。</translation>
    </message>
    <message>
        <source>The result&apos;s poses belong to another frame than {frame}, which starts from them nevertheless.</source>
        <translation>結果の姿勢はフレーム {frame} のものではありませんが、そこから開始します。</translation>
    </message>
</context>
<context>
    <name>study.track_request</name>
    <message>
        <source>where the CT has the bones</source>
        <translation>CT の骨の位置</translation>
    </message>
    <message>
        <source>registration of the first frame</source>
        <translation>最初のフレームの位置合わせ</translation>
    </message>
    <message>
        <source>poses of the present result</source>
        <translation>現在の結果の姿勢</translation>
    </message>
</context>
<context>
    <name>study.track_scene</name>
    <message>
        <source>Track</source>
        <translation>追跡</translation>
    </message>
    <message>
        <source>Track, all numbers</source>
        <translation>追跡、すべての数値</translation>
    </message>
    <message>
        <source>{bone} poses</source>
        <translation>{bone}: 位置姿勢の列</translation>
    </message>
    <message>
        <source>The X-rays &apos;{image}&apos; have {columns} x {rows} pixels, but the track&apos;s camera &apos;{camera}&apos; has {width} x {height}: choose those that were tracked.</source>
        <translation>X線画像「{image}」は {columns} x {rows} 画素ですが、追跡のカメラ「{camera}」は {width} x {height} です。追跡に使った画像を選択してください。</translation>
    </message>
    <message>
        <source>{bone} pose</source>
        <translation>{bone}: 位置姿勢</translation>
    </message>
    <message>
        <source>{bone} in motion</source>
        <translation>{bone}(動き)</translation>
    </message>
    <message>
        <source>The track&apos;s structure &apos;{name}&apos; has no segment: assign it in the first section.</source>
        <translation>追跡の構造「{name}」にセグメントがありません。最初のセクションで割り当ててください。</translation>
    </message>
    <message>
        <source>The segments of &apos;{name}&apos; hold no voxel: draw them.</source>
        <translation>「{name}」のセグメントにボクセルがありません。描画してください。</translation>
    </message>
    <message>
        <source>The segments of &apos;{name}&apos; are not where they were when the track was made: choose its CT and segmentation, and put them where they were.</source>
        <translation>「{name}」のセグメントが追跡時の位置にありません。追跡に使った CT とセグメンテーションを選び、元の位置に戻してください。</translation>
    </message>
</context>
<context>
    <name>study.track_settings</name>
    <message>
        <source>The track &apos;{name}&apos; of the scene is damaged: delete it, and track again.</source>
        <translation>シーンの追跡「{name}」が壊れています。削除して、もう一度追跡してください。</translation>
    </message>
</context>
<context>
    <name>study.track_writer</name>
    <message>
        <source>The tracking was cancelled.</source>
        <translation>追跡はキャンセルされました。</translation>
    </message>
</context>
<context>
    <name>study.writer</name>
    <message>
        <source>The segmentation &apos;{segmentation}&apos; has {count} segments named &apos;{name}&apos;: give the ID of one.</source>
        <translation>セグメンテーション「{segmentation}」には「{name}」という名前のセグメントが {count} 個あります。いずれかのIDを指定してください。</translation>
    </message>
    <message>
        <source>No CT is chosen: choose a volume.</source>
        <translation>CTが選択されていません。ボリュームを選択してください。</translation>
    </message>
    <message>
        <source>No segmentation is chosen: choose that of the CT&apos;s bones.</source>
        <translation>セグメンテーションが選択されていません。CTの骨のものを選択してください。</translation>
    </message>
    <message>
        <source>No structure is chosen: include at least the anchor and one other bone.</source>
        <translation>構造が選択されていません。少なくともアンカーともう1つの骨を含めてください。</translation>
    </message>
    <message>
        <source>There is no X-ray: add at least one; two from different directions are better.</source>
        <translation>X線画像がありません。少なくとも1枚追加してください。方向の異なる2枚が望ましいです。</translation>
    </message>
    <message>
        <source>The segmentation &apos;{segmentation}&apos; has no segment named &apos;{name}&apos;.</source>
        <translation>セグメンテーション「{segmentation}」に「{name}」という名前のセグメントがありません。</translation>
    </message>
    <message>
        <source>The anchor &apos;{anchor}&apos; is not one of the structures: choose one of them.</source>
        <translation>アンカー「{anchor}」は構造に含まれていません。構造から選択してください。</translation>
    </message>
    <message>
        <source>PolyPose needs about {needed:.1f} GB in {folder}, where {free:.1f} GB are free: free some space, or set another temporary folder in Slicer&apos;s settings.</source>
        <translation>PolyPose は {folder} に約 {needed:.1f} GB を必要としますが、空きは {free:.1f} GB です。空きを増やすか、Slicer の設定で別の一時フォルダーを選んでください。</translation>
    </message>
    <message>
        <source>The structure &apos;{structure}&apos; has no voxels of its own inside the CT: leave it out, or correct its segments.</source>
        <translation>構造「{structure}」にはCT内に固有のボクセルがありません。除外するか、セグメントを修正してください。</translation>
    </message>
    <message>
        <source>{file} could not be written completely into {folder}: free some space there, or set another temporary folder in Slicer&apos;s settings.</source>
        <translation>{file} を {folder} に完全に書き込めませんでした。空き容量を増やすか、Slicerの設定で別の一時フォルダーを指定してください。</translation>
    </message>
    <message>
        <source>Segment &apos;{segment}&apos; shares {percent:.0f} % of its voxels with other structures, which keep them: correct the segmentation where they overlap.</source>
        <translation>セグメント「{segment}」はボクセルの {percent:.0f} % を他の構造と共有しており、それらは他の構造に属します。重なっている箇所のセグメンテーションを修正してください。</translation>
    </message>
</context>
<context>
    <name>study.xray_reading</name>
    <message>
        <source>the table of X-rays</source>
        <translation>X線画像の表</translation>
    </message>
    <message>
        <source>initial</source>
        <translation>初期</translation>
    </message>
    <message>
        <source>ready</source>
        <translation>準備完了</translation>
    </message>
    <message>
        <source>known exactly</source>
        <translation>正確に既知</translation>
    </message>
    <message>
        <source>none yet: it will be searched for, unless you place the C-arm</source>
        <translation>未定: Cアームを配置しなければ探索されます</translation>
    </message>
    <message>
        <source>unknown</source>
        <translation>不明</translation>
    </message>
    <message>
        <source>not ready</source>
        <translation>準備未完了</translation>
    </message>
    <message>
        <source>none yet: an uncertain one was found, review it</source>
        <translation>未定: 不確実なカメラが見つかりました。確認してください</translation>
    </message>
    <message>
        <source>uncertain, accepted by you</source>
        <translation>不確実(承認済み)</translation>
    </message>
    <message>
        <source>initial, from landmarks</source>
        <translation>初期(ランドマークによる)</translation>
    </message>
    <message>
        <source>none yet: pick landmarks</source>
        <translation>未定: ランドマークを配置してください</translation>
    </message>
    <message>
        <source>DICOM</source>
        <translation>DICOM</translation>
    </message>
    <message>
        <source>ready; {count} warnings</source>
        <translation>準備完了、警告 {count} 件</translation>
    </message>
    <message>
        <source>found, within {degrees:.0f} deg and {mm:.0f} mm</source>
        <translation>検出済み、{degrees:.0f}°・{mm:.0f} mm 以内</translation>
    </message>
    <message>
        <source>initial, within {degrees:.0f} deg and {mm:.0f} mm</source>
        <translation>初期、{degrees:.0f}°・{mm:.0f} mm 以内</translation>
    </message>
    <message>
        <source>transform</source>
        <translation>変換</translation>
    </message>
    <message>
        <source>image only</source>
        <translation>画像のみ</translation>
    </message>
    <message>
        <source>{file} does not describe the geometry of &apos;{xray}&apos;: choose a study file with an entry for it.</source>
        <translation>{file} には「{xray}」のジオメトリがありません。その項目を含むスタディファイルを選択してください。</translation>
    </message>
    <message>
        <source>Warning: {text}</source>
        <translation>警告: {text}</translation>
    </message>
    <message>
        <source>known, from a file</source>
        <translation>既知(ファイルによる)</translation>
    </message>
    <message>
        <source>geometry file</source>
        <translation>ジオメトリファイル</translation>
    </message>
    <message>
        <source>entered</source>
        <translation>入力値</translation>
    </message>
    <message>
        <source>{file} cannot be read as JSON ({reason}): choose a study file.</source>
        <translation>{file} をJSONとして読み込めません({reason})。スタディファイルを選択してください。</translation>
    </message>
    <message>
        <source>It cannot be read: {reason}.</source>
        <translation>読み込めません: {reason}。</translation>
    </message>
</context>
<context>
    <name>study.xray_series</name>
    <message>
        <source>The sequence &apos;{name}&apos; has {count} images, but its file has {in_file}: load it again from its file.</source>
        <translation>シーケンス &apos;{name}&apos; には画像が {count} 枚ありますが、そのファイルには {in_file} 枚あります。ファイルから読み込み直してください。</translation>
    </message>
    <message>
        <source>Image {number} of the sequence &apos;{name}&apos; has another size, type or spacing than the first: choose a sequence of one camera.</source>
        <translation>シーケンス &apos;{name}&apos; の画像 {number} は、最初の画像と大きさ、型または間隔が異なります。1 台のカメラのシーケンスを選んでください。</translation>
    </message>
</context>
<context>
    <name>study.xray_source</name>
    <message>
        <source>The stored fields of an X-ray are damaged: remove the X-ray and add it again.</source>
        <translation>X線画像の保存された項目が壊れています。X線画像を削除して追加し直してください。</translation>
    </message>
    <message>
        <source>An X-ray needs an image of the scene or a file: choose one.</source>
        <translation>X線画像にはシーンの画像またはファイルが必要です。いずれかを選択してください。</translation>
    </message>
    <message>
        <source>The sequence &apos;{name}&apos; has {count} images: choose one of them as the frame.</source>
        <translation>シーケンス「{name}」には画像が {count} 枚あります。フレームとして1枚を選択してください。</translation>
    </message>
    <message>
        <source>The sequence &apos;{name}&apos; does not hold images: choose another.</source>
        <translation>シーケンス「{name}」に画像がありません。別のものを選択してください。</translation>
    </message>
    <message>
        <source>&apos;{name}&apos; is not an image: choose a volume or a sequence of volumes.</source>
        <translation>「{name}」は画像ではありません。ボリュームまたはボリュームのシーケンスを選択してください。</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; has no pixels: load it again.</source>
        <translation>X線画像「{name}」にピクセルがありません。読み込み直してください。</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is a volume of {count} images: choose one of them as its frame.</source>
        <translation>X線画像「{name}」は {count} 枚の画像からなるボリュームです。フレームとして1枚を選択してください。</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; has {count} images: choose one of them as its frame.</source>
        <translation>X線画像「{name}」には画像が {count} 枚あります。フレームとして1枚を選択してください。</translation>
    </message>
    <message>
        <source>The X-ray &apos;{name}&apos; is a file and not an image of the scene: load it.</source>
        <translation>X線画像「{name}」はシーンの画像ではなくファイルです。読み込んでください。</translation>
    </message>
</context>
</TS>
