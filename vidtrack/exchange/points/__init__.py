"""Points in space that another instrument measured (C3D, QTM TSV and MAT), as reference or truth of a run; one module a
format."""
