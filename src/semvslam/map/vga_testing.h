#pragma once

#include "semvslam/geometry/camera.h"

namespace semvslam {

/// Of the tests of map and mapping: 640x480, no distortion, the centre in the middle of the image.
inline Camera vga() {
  Camera c;
  c.width_px = 640;
  c.height_px = 480;
  c.fx_px = c.fy_px = 500;
  c.cx_px = 320;
  c.cy_px = 240;
  return c;
}

}  // namespace semvslam
