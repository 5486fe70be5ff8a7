"""Files that are carried between the CT and the patient as X-rayed, one module a kind."""
