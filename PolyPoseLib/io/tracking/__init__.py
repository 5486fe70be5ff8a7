"""Files of a registration over time: TRACK.json with its images, the checkpoint of a run, and the folder of a track."""
