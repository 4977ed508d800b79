"""Random experiments with known truth, one spoiled circumstance each: is what is wrong said, is what is said right?"""
