"""What a wave laboratory quotes of motions and waves: decay, harmonics, spectra, response."""
