"""Finding the cameras and the motions of all structures."""
