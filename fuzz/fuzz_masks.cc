// What comes with masks: labelled data sets and regions (COCO), descriptions of networks, roles of classes.
#include <nlohmann/json.hpp>
#include <string>

#include "check.h"
#include "semvslam/semantic/coco_dataset.h"
#include "semvslam/semantic/model_description.h"
#include "semvslam/semantic/roles.h"

using namespace semvslam;

namespace {

const cv::Size kSize(64, 48);

void draw(const CocoRegion& region) {
  const cv::Mat mask = region.mask(kSize);
  FUZZ_CHECK(mask.size() == kSize);
  // What was drawn is packed and parsed to the same pixels.
  const nlohmann::json packed{{"counts", pack_region(mask, {{}, kSize}, kSize)}};
  const cv::Mat again = CocoRegion::parse(packed).mask(kSize);
  FUZZ_CHECK(std::equal(mask.begin<std::uint8_t>(), mask.end<std::uint8_t>(), again.begin<std::uint8_t>()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (const auto dataset = CocoDataset::parse(text, "f"); !dataset) {
    FUZZ_CHECK_MESSAGE(dataset.error());
  } else {
    for (const CocoImage& image : dataset->images)
      for (const CocoObject& object : image.objects) draw(object.region);
  }
  if (const auto model = ModelDescription::parse(text, "f"); !model) {
    FUZZ_CHECK_MESSAGE(model.error());
  }
  if (const auto roles = RoleTable::from_yaml(text, "f"); !roles) {
    FUZZ_CHECK_MESSAGE(roles.error());
  }
  try {
    draw(CocoRegion::parse(nlohmann::json::parse(text)));
  } catch (const std::exception&) {  // says what is wrong with it
  }
  return 0;
}
