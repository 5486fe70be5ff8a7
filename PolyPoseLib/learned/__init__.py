"""A patient-specific regressor of cameras, trained on renderings of one CT only."""
