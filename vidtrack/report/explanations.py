"""What each table of the report is, for a reader who does not know the method: shown on request, below the table."""

from __future__ import annotations

ABOUT = {
    "runs": (
        "Located: share of the samples that have a position. Mean sigma: the expected error of a position (one "
        "standard deviation, all axes together) as the calibration and the centroids' noise make it. Lag: by how "
        "much the video shows the motion later than the contact sensor."
    ),
    "all-runs": (
        "Every run that has positions. Mean sigma: on the axis where it is largest. Rms: of the differences from the "
        "contact sensor when the lag is removed. Against truth: the mean error as a share of the diagonal field."
    ),
    "cameras": (
        "Reprojection error: the distance in the picture between where a calibration point is seen and where the "
        "calibrated camera would show it, root mean square. f: focal length with its standard deviation."
    ),
    "axis": (
        "Every calibration point is located by the cameras like a target, and the survey is subtracted. Held out: "
        "the point itself was left out of the calibration first, so that this is the error of a new point. Floor "
        "by noise: what exactly known cameras would reach with the same centroid noise."
    ),
    "share": (
        "The mean errors beside the size of what is measured: the largest distance between two points, and the "
        "diagonal of the picture at the mean distance of the points. The worst tag is where to look first."
    ),
    "measures": (
        "Willson's measures of calibration error. Distorted: in the picture as recorded; undistorted: after the "
        "lens distortion is removed; object space: how far the line of sight passes from the surveyed point; "
        "normalised: that distance over the rounding error of a pixel at the point, so that 1 is as good as whole "
        "pixels allow."
    ),
    "interfaces": "Windows, walls and water surfaces between the camera and its points. By how much the points move "
    "each of their parameters from what the config says, how well it is known now, and how well it was known before: "
    "where both are alike, the points say nothing of it.",
    "parameters": (
        "Tsai's camera. Cx, Cy: where the optical axis meets the picture. f: focal length. Sx: scale of the "
        "columns. kappa and the further terms: the lens distortion. Position: of the camera's centre in the "
        "world. omega, t: standard deviations of its attitude and place about the middle of the points, where "
        "they are least correlated."
    ),
    "movement": (
        "Each camera calibrated again by the clips filmed after the test, compared with before. In the picture: "
        "how far a still point would have moved. Moved: yes where a camera at rest would show as much once in "
        "1000 times."
    ),
    "comparison": (
        "reference = gain x video + bias, by least squares, before and after the lag between the two clocks is "
        "removed. The limits within which 95 % of the differences lie stand in comparison.json."
    ),
    "truth": (
        "Positions minus those of truth.csv, a better instrument, which no other stage reads. Bias: the mean "
        "error with its sign; mean error: without it."
    ),
    "reading": (
        "How each recording was read and the targets followed in it. Measured: share of samples with a centroid. "
        "Flags: why the others have none, or a worse one; docs/reference.md explains each."
    ),
    "clocks": (
        "What is added to each camera's time so that all share one. The rate says by how much a camera's clock "
        "runs slow, in parts per million: 50 ppm are 3 ms a minute."
    ),
    "correspondence": (
        "Which track of each camera is which target. A point seen in one camera lies on a line in another one's "
        "picture, the epipolar line: the error is the distance from it, over the whole run."
    ),
    "run-up": (
        "How high the water's edge runs up each transect, above the still water where the config says its level, else "
        "above z = 0. Set-up: the mean. S: swash, four standard deviations about it; Sinc and Sig: its parts above and "
        "below 0.05 Hz. R2 %: the height that 2 % of the run-up maxima exceed."
    ),
    "campaign": (
        "Each run a line: under which conditions it was made (runs.csv), and what was measured in it, with half of its "
        "95 % interval. The run's name leads to its page."
    ),
    "repeatability": (
        "Runs under the same conditions with the same analysis are repeats. Standard deviation: of a single run. Type "
        "A: the standard uncertainty of their mean, the deviation over the root of their number; the interval is by "
        "Student's t."
    ),
    "pooled": (
        "The mean of the repeats, weighted by the precision of each. Where they scatter by more than their own "
        "intervals explain, that scatter is in the interval."
    ),
    "full-scale": (
        "Lengths times the scale, times and periods times its root, frequencies over its root; damping ratios and "
        "ratios of lengths stay; degrees a length are divided by the scale."
    ),
    "uncertainty": (
        "Where the uncertainty of one sample comes from (GUM; ITTC 7.5-02-07-02.1), as standard uncertainties: survey, "
        "calibration for a given survey, centroids, the cameras' clocks, the lever arm from the body's origin to the "
        "point, repeats (type A). Combined: the root of the sum of squares. Expanded: twice that, some 95 %. Motions "
        "have the first four in the shares of positions along that axis."
    ),
    "points-not-used": "Points that were seen and left out of this camera's calibration, with the reason.",
    "motions": (
        "The body's six degrees of freedom at this point, in the basin's axes: surge along the waves, heave upward, "
        "sway to complete a right-handed set; roll, pitch and yaw about these (yaw first, then pitch, then roll). "
        "Drift: the mean of the last quarter less that of the first. Sigma: what a single sample is worth."
    ),
    "decay": (
        "The equation of motion, integrated through the samples from the release on, fitted to them. fn: without "
        "damping; Td: period as it swings. Zeta: linear damping over critical damping. The decrement of half cycles is "
        "the classical check, from the peaks alone (p and q)."
    ),
    "energy": "A free decay is of one degree of freedom; what else moved is in the numbers of the decay.",
    "channels": (
        "Other instruments run on a clock of their own. A lamp that both record, or a motion that both measure, joins "
        "it to the video's; the wave itself never does, because its phase is what is to be measured."
    ),
    "waves": (
        "Regular: the harmonics of the wave, by least squares over whole periods. Irregular: Hm0, Tp, Tz and Te by the "
        "spectrum (Welch), H1/3 and the like by single waves between upward crossings of the mean."
    ),
    "responses": (
        "RAO: the amplitude of a motion over that of the wave. Phase: by how many degrees it follows the wave's crest. "
        "The intervals hold noise, the error of the other instruments' clock, and what the calibration leaves open of "
        "scale and axes."
    ),
    "harmonics": (
        "What a motion has at twice and three times the frequency of the wave: amplitude, and phase after the crest of "
        "the fundamental, in degrees of its own period."
    ),
    "provenance": (
        "The settings and the files that the numbers on this page were made with, as they stand under `provenance` in "
        "every file of results/. The checksum of a file is SHA-256: the same file has the same one."
    ),
    "bodies": (
        "A rigid body is fitted to its targets in every sample. Off the rigid body: the distance between where "
        "targets are and where the body has them."
    ),
    "wand-held-out": (
        "Each lens is fitted to some of the moments and predicts the others. Error: of their sights and lengths "
        "together, to compare the models by. The plainest lens that predicts as well as any is used."
    ),
    "wand-clocks": "How much later than the first camera's each clock is, estimated from the wand's motion.",
    "body-held-out": (
        "Half of the stretches of time refine the cameras, the other half judges them, and the other way round. Only "
        "where they are surely better, and neither number is surely worse, the refined cameras are used."
    ),
    "body-distances": "As config.yaml has the body, and as the cameras see it without being given its distances.",
    "coded-tags": (
        "Corners off: from where the pose and the calibration put them. Sd grown: times the noise of the picture. Size "
        "seen: by several cameras, or several tags; one tag before one camera does not show it."
    ),
    "smoothing": (
        "Velocities and accelerations come from a smoothing spline. Scatter: of the positions about it. Over "
        "sigma: 1 where sigma is all noise; less where sigma holds errors that last, as of the calibration."
    ),
}
"""By table."""
