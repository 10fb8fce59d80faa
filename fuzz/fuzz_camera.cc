// Camera files.
#include <string>

#include "check.h"
#include "semvslam/data/camera_file.h"

using namespace semvslam;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Result<Camera> camera = parse_camera(std::string(reinterpret_cast<const char*>(data), size), "f");
  if (!camera) {
    FUZZ_CHECK_MESSAGE(camera.error());
    return 0;
  }
  FUZZ_CHECK(camera->check().ok());
  const Result<Camera> again = parse_camera(format_camera(*camera), "g");
  FUZZ_CHECK(again.ok());
  FUZZ_CHECK(format_camera(*again) == format_camera(*camera));
  return 0;
}
