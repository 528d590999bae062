"""Coastal water of the North Sea, a dark floor at 25 m, a low sun."""

import bpy

water = bpy.context.scene.underwater

water.water = "jerlov:3C"
water.water_source = "solonenko2015"
water.second_water = ""
water.second_water_share = 0.0
water.absorption_factor = 1.0
water.scattering_factor = 1.0
water.phase = "mixture"
water.floor_depth = 25.0
water.floor_reflectance = "0.1"
water.surface = "flat"
water.illuminant = "clear-sky"
water.sun_zenith = 50.0
water.irradiance = "above"
water.sky = "uniform"
water.sky_radiance = 0.0
water.white_balance = "daylight"
water.exposure = "auto-picture"
water.exposure_compensation = 0.0
water.tone = "nikon-d7000"
water.contrast = "medium"
