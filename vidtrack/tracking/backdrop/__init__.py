"""A still pattern behind the targets: made even before they are measured, or taken off their centroids."""
