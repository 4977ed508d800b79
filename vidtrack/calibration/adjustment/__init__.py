"""One least-squares adjustment for whatever calibrates: survey, wand, board, body, interfaces.

normal_equations  measurements linearised, summed with the blocks eliminated, solved; covariances
unknowns          cameras, shared parameters and families of blocks, and how each takes a step
measurements      sights of points by a camera, lengths, what is known beforehand
adjust            Levenberg-Marquardt, the noise of each group found from its residuals
"""
