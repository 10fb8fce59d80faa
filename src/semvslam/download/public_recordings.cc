#include "semvslam/download/public_recordings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <span>

#include "semvslam/base/foreign_text.h"

namespace semvslam {
namespace {

constexpr std::array kFreiburg1 = {"360", "desk", "desk2", "floor", "plant", "room", "rpy", "teddy", "xyz"};
constexpr std::array kFreiburg2 = {"360_hemisphere",
                                   "360_kidnap",
                                   "coke",
                                   "desk",
                                   "desk_with_person",
                                   "dishes",
                                   "flowerbouquet",
                                   "flowerbouquet_brownbackground",
                                   "large_no_loop",
                                   "large_with_loop",
                                   "metallic_sphere",
                                   "metallic_sphere2",
                                   "pioneer_360",
                                   "pioneer_slam",
                                   "pioneer_slam2",
                                   "pioneer_slam3",
                                   "rpy",
                                   "xyz"};
constexpr std::array kFreiburg3 = {"cabinet",
                                   "large_cabinet",
                                   "long_office_household",
                                   "nostructure_notexture_far",
                                   "nostructure_notexture_near_withloop",
                                   "nostructure_texture_far",
                                   "nostructure_texture_near_withloop",
                                   "sitting_halfsphere",
                                   "sitting_rpy",
                                   "sitting_static",
                                   "sitting_xyz",
                                   "structure_notexture_far",
                                   "structure_notexture_near",
                                   "structure_texture_far",
                                   "structure_texture_near",
                                   "teddy",
                                   "walking_halfsphere",
                                   "walking_rpy",
                                   "walking_static",
                                   "walking_xyz"};
constexpr std::array kPaper = {"fr3_walking_xyz", "fr3_walking_rpy", "fr3_walking_halfsphere", "fr3_walking_static",
                               "fr3_sitting_xyz", "fr3_sitting_rpy", "fr3_sitting_halfsphere", "fr3_sitting_static"};
constexpr std::array kBonn = {"balloon",
                              "balloon2",
                              "balloon_tracking",
                              "balloon_tracking2",
                              "crowd",
                              "crowd2",
                              "crowd3",
                              "kidnapping_box",
                              "kidnapping_box2",
                              "moving_nonobstructing_box",
                              "moving_nonobstructing_box2",
                              "moving_obstructing_box",
                              "moving_obstructing_box2",
                              "person_tracking",
                              "person_tracking2",
                              "placing_nonobstructing_box",
                              "placing_nonobstructing_box2",
                              "placing_nonobstructing_box3",
                              "placing_obstructing_box",
                              "removing_nonobstructing_box",
                              "removing_nonobstructing_box2",
                              "removing_obstructing_box",
                              "static",
                              "static_close_far",
                              "synchronous",
                              "synchronous2"};

const std::map<std::string, std::string, std::less<>>& known_checksums() {
  static const std::map<std::string, std::string, std::less<>> all = {
      {"rgbd_dataset_freiburg3_sitting_xyz", "05c071672cda22a668860a935124737a4eb4fa772cbad372e73d5a99ce4be205"},
      {"rgbd_dataset_freiburg3_walking_static", "8aca832bf01746aa95fcc0b15bf42d78ad3bb8edef672ba4cc94a404b194f6c1"},
      {"rgbd_dataset_freiburg3_walking_xyz", "1459e9488ac0e61a2ec80dfbc35cfb77942f6d8eabded1c8d26a70be650d0e1d"},
      {"rgbd_bonn_person_tracking", "a4810fd91ef2ea1d630b53fe0df5d76144c1b18d86ca91fb3a035debd0c9c5f5"},
  };
  return all;
}

void add(PublicDataset& dataset, std::string short_name, std::string folder, const char* extension, std::string base) {
  const auto checksum = known_checksums().find(folder);
  std::string archive = folder + extension;
  dataset.recordings.push_back({std::move(short_name), std::move(folder), std::move(archive), std::move(base),
                                checksum == known_checksums().end() ? "" : checksum->second});
}

PublicDataset tum() {
  PublicDataset out{"tum", "TUM RGB-D benchmark, Technical University of Munich, CC BY 4.0", {}, "paper", {}};
  const auto add_all = [&](int camera, std::span<const char* const> names) {
    for (const char* name : names)
      add(out, fmt::format("fr{}_{}", camera, name), fmt::format("rgbd_dataset_freiburg{}_{}", camera, name), ".tgz",
          fmt::format("https://cvg.cit.tum.de/rgbd/dataset/freiburg{}", camera));
  };
  add_all(1, kFreiburg1);
  add_all(2, kFreiburg2);
  add_all(3, kFreiburg3);
  out.group_names.assign(kPaper.begin(), kPaper.end());
  return out;
}

PublicDataset bonn() {
  PublicDataset out{"bonn", "Bonn RGB-D Dynamic Dataset, University of Bonn; its page asks to cite it", {}, {}, {}};
  for (const char* name : kBonn)
    add(out, name, fmt::format("rgbd_bonn_{}", name), ".zip",
        "https://www.ipb.uni-bonn.de/html/projects/rgbd_dynamic2019");
  return out;
}

/// What users may have from elsewhere: freiburg3_walking_xyz, fr3/walking_xyz.
std::string canonical(std::string_view name) {
  std::string out(name);
  std::ranges::replace(out, '/', '_');
  if (out.starts_with("freiburg")) out.replace(0, std::string_view("freiburg").size(), "fr");
  return out;
}

template <typename Range, typename Name>
std::string_view nearest(const Range& all, std::string_view wanted, const Name& name_of) {
  const auto distance = [&](const auto& one) { return edit_distance(name_of(one), wanted.substr(0, 60)); };
  return name_of(*std::ranges::min_element(all, {}, distance));
}

}  // namespace

const std::vector<PublicDataset>& public_datasets() {
  static const std::vector<PublicDataset> all = {tum(), bonn()};
  return all;
}

Result<std::vector<PublicRecording>> find_public_recordings(std::string_view dataset, std::string_view name) {
  const auto& all = public_datasets();
  const auto found = std::ranges::find(all, dataset, &PublicDataset::name);
  if (found == all.end())
    return invalid_input(fmt::format("unknown dataset {}; the nearest known one is '{}'", in_quotes(dataset),
                                     nearest(all, dataset, [](const PublicDataset& d) { return d.name; })));
  std::vector<PublicRecording> out;
  const std::string wanted = canonical(name);
  const bool is_group = !found->group.empty() && wanted == found->group;
  for (const PublicRecording& r : found->recordings)
    if (is_group ? std::ranges::count(found->group_names, r.short_name) > 0
                 : r.short_name == wanted || r.folder == name)
      out.push_back(r);
  if (out.empty())
    return invalid_input(fmt::format(
        "unknown recording {} of {}; the nearest known one is '{}' (--list shows all)", in_quotes(name), dataset,
        nearest(found->recordings, wanted, [](const PublicRecording& r) { return std::string_view(r.short_name); })));
  return out;
}

}  // namespace semvslam
