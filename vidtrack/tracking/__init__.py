"""From pictures to centroids and tracklets, in one camera.

Here lie what all its rooms share (a sample, what is known of the targets, how they are distinguished from the
background) and the tracker, which uses them all. The rooms, along the way of the data: `pictures`, `initiation`,
`detection`, `centroiding` (with `backdrop`, `discs`, `outlines`), `following`, `recovery`, `uncertainty`, `quality`;
and `tag_reading`.
"""
