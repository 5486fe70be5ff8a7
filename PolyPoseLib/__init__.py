"""PolyPose: polyrigid deformable 2D/3D registration of one CT to two or more X-rays."""

__version__ = "0.1.0"
