#pragma once

#include <filesystem>
#include <map>

#include "semvslam/semantic/segmenter.h"

namespace semvslam {

/// Masks made elsewhere: a folder with one file per image.
/// - PNG, one channel of 8 or 16 bits: 0 = nothing, n = object n of that image. `roles.json` in the folder or beside it
///   names the class of each number: a list of {"number": 1, "label": "person"}; without it every number is a person.
/// - JSON, as `semvslam segment` writes it: {"width", "height", "instances": [{"class", "segmentation", "score"}]},
///   the segmentation as in the COCO data set (polygons or run lengths), the score optional. Wins over a PNG.
/// What `segment` writes beside its JSON (x.overlay.png, x.instances.png) is passed over.
class FolderSegmenter final : public Segmenter {
 public:
  /// Errors: no such folder, no such file in it, a roles.json that is damaged.
  static Result<std::unique_ptr<FolderSegmenter>> open(const std::filesystem::path& folder, const RoleTable& roles);

  /// The file with the request's name, else with the nearest stamp within 20 ms. No file = no instances. Errors: a
  /// damaged file, another size than the image's.
  Result<Segmentation> segment(const SegmentationRequest& request) override;
  /// Whether there is a file for it: an image without one was perhaps only not looked at.
  bool has(const SegmentationRequest& request) const { return find(request) != nullptr; }
  /// Grows with the classes that JSON files name; a class keeps its place.
  const std::vector<std::string>& class_names() const override { return names_; }
  std::string description() const override;

 private:
  FolderSegmenter() = default;
  const std::filesystem::path* find(const SegmentationRequest& request) const;
  Status read_roles();
  Status read_labels(const std::filesystem::path& file, Segmentation& out) const;
  Status read_json(const std::filesystem::path& file, Segmentation& out);
  int class_of(const std::string& name);

  std::filesystem::path folder_;
  std::map<std::string, std::filesystem::path> by_name_;  // file name without extension
  std::map<TimeStamp, std::filesystem::path> by_stamp_;   // where the name is a number of seconds
  std::map<int, int> class_of_number_;                    // into names_
  std::vector<std::string> names_;
  RoleTable roles_;
};

}  // namespace semvslam
