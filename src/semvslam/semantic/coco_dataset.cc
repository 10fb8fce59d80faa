#include "semvslam/semantic/coco_dataset.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "semvslam/data/file_io.h"
#include "semvslam/semantic/json_fault.h"
#include "semvslam/semantic/json_integer.h"

namespace semvslam {
namespace {

CocoObject parse_object(const nlohmann::json& j) {
  CocoObject o;
  o.category = integer_at<int>(j, "category_id");
  for (const char* key : {"iscrowd", "ignore"})
    if (j.contains(key) && integer_at<int>(j, key) != 0) o.crowd = true;
  const auto box = j.at("bbox").get<std::vector<double>>();
  if (box.size() != 4) throw std::invalid_argument("a 'bbox' has not four numbers");
  o.box = {box[0], box[1], box[2], box[3]};
  o.region = CocoRegion::parse(j.at("segmentation"));
  return o;
}

}  // namespace

Result<CocoDataset> CocoDataset::parse(const std::string& text, const std::string& origin) {
  CocoDataset out;
  try {
    const nlohmann::json root = nlohmann::json::parse(text);
    std::map<std::int64_t, std::size_t> index;
    for (const nlohmann::json& i : root.at("images")) {
      index[integer_at<std::int64_t>(i, "id")] = out.images.size();
      out.images.push_back(
          {i.at("file_name").get<std::string>(), {integer_at<int>(i, "width"), integer_at<int>(i, "height")}, {}});
    }
    for (const nlohmann::json& c : root.at("categories"))
      out.categories[integer_at<int>(c, "id")] = c.at("name").get<std::string>();
    for (const nlohmann::json& a : root.at("annotations")) {
      const auto at = index.find(integer_at<std::int64_t>(a, "image_id"));
      if (at == index.end()) throw std::invalid_argument("an annotation of an image that is not listed");
      out.images[at->second].objects.push_back(parse_object(a));
    }
  } catch (const std::exception& e) {
    return Error{ErrorCode::kInvalidInput, fmt::format("{}: {}", origin, json_fault(e))};
  }
  return out;
}

Result<CocoDataset> CocoDataset::read(const std::filesystem::path& json) {
  const Result<std::string> text = read_text_file(json);
  if (!text) return text.error();
  return parse(*text, json.string());
}

}  // namespace semvslam
