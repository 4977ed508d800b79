"""Where a detected target is, and how sure: template, window, moments, fits, deblending, empirical sd."""
