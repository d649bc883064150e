"""Library of the notebooks: flights, analysis, figures, tables, and the rendered copies."""
