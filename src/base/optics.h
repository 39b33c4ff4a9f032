// Laws of light that several places compute by: the scalar kernels, their SIMD twins, the scene, the pictures.
#pragma once

// gamma(x) = x^0.22 (Flash-Splat, section 3): the encoding of the models' colours, of targets and of layer PNGs.
#define FS_OPTICS_GAMMA 0.22f

// Schlick's form of Fresnel's law for glass, over the reflectance at normal incidence: 1 + GRAZING (1 - |cosine|)^5;
// a reflectance is at most MOST.
#define FS_OPTICS_GRAZING 22
#define FS_OPTICS_MOST 0.97

// A camera's photometric calibration (kernels/calibration.h): coefficients of the vignetting; knots of the response and
// what lies between them, tone-mapped.
#define FS_OPTICS_VIGNETTING 3
#define FS_OPTICS_KNOTS 11
#define FS_OPTICS_SPACING 0.125f
