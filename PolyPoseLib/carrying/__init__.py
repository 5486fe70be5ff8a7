"""Points, meshes and images carried between the CT and the patient as X-rayed."""
