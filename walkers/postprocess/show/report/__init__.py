"""Reports: one HTML file of a run, with plots and a scene that plays, which needs no network; and its pieces."""
