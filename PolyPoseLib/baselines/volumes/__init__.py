"""Systems of 3D/3D registration, between a cone-beam reconstruction of the X-rays and the CT."""
