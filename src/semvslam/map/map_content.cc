#include "semvslam/map/map_content.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "semvslam/map/byte_stream.h"

namespace semvslam {
namespace {

constexpr std::size_t kFeatureBytes = 7 * sizeof(float) + sizeof(std::uint8_t) + sizeof(Descriptor);
constexpr std::size_t kKeyFrameBytes = 88, kLandmarkBytes = 96;  // with nothing in them
constexpr std::size_t kObservationBytes = 2 * sizeof(std::uint32_t), kRunBytes = 3 * sizeof(std::uint16_t);
constexpr std::uint32_t kMostIds = 1u << 31;  // far from where the counters would run over
constexpr int kMostSeen = 100'000'000;        // frames
constexpr double kUnitTolerance = 1e-6;

// One list of fields for writing and reading each of these: it cannot differ between the two.
template <typename CameraType, typename Visit>
void visit_camera(CameraType& c, const Visit& visit) {
  visit(c.width_px), visit(c.height_px);
  visit(c.fx_px), visit(c.fy_px), visit(c.cx_px), visit(c.cy_px);
  visit(c.distortion.k1), visit(c.distortion.k2), visit(c.distortion.p1), visit(c.distortion.p2);
  visit(c.distortion.k3);
  visit(c.depth_units_per_m), visit(c.baseline_m), visit(c.frame_rate_hz);
}

template <typename NoiseType, typename Visit>
void visit_noise(NoiseType& n, const Visit& visit) {
  visit(n.pixel_sigma_px), visit(n.disparity_sigma_px), visit(n.disparity_weight);
  visit(n.depth_edge_ratio), visit(n.min_depth_m), visit(n.max_depth_m);
}

template <typename KeypointType, typename Visit>
void visit_keypoint(KeypointType& k, const Visit& visit) {
  visit(k.x_px), visit(k.y_px), visit(k.response), visit(k.angle_rad), visit(k.level);
}

void put_vector(ByteWriter& out, const auto& vector) {
  for (const auto value : vector) out.put(value);
}

template <typename Vector>
Vector get_vector(ByteReader& in) {
  Vector vector;
  for (auto& value : vector) value = in.get<typename Vector::Scalar>();
  return vector;
}

void put_mask(ByteWriter& out, const MaskRuns& mask) {
  out.put(mask.size().width);
  out.put(mask.size().height);
  std::size_t runs = 0;
  for (int y = 0; y < mask.size().height; ++y) runs += mask.row(y).size();
  out.put(static_cast<std::uint32_t>(runs));
  for (int y = 0; y < mask.size().height; ++y)
    for (const MaskRuns::Run& run : mask.row(y))
      out.put(static_cast<std::uint16_t>(y)), out.put(run.begin), out.put(run.end);
}

void put_features(ByteWriter& out, const FrameFeatures& features) {
  out.put(static_cast<std::uint32_t>(features.size()));
  for (std::size_t i = 0; i < features.size(); ++i) {
    visit_keypoint(features.orb.keypoints[i], [&](auto value) { out.put(value); });
    put_vector(out, features.orb.descriptors[i]);
    out.put(features.x_px[i]), out.put(features.y_px[i]), out.put(features.depth_m[i]);
  }
  put_mask(out, features.moving);
}

void put_key_frame(ByteWriter& out, const KeyFrame& key_frame) {
  out.put(key_frame.id.value);
  out.put(key_frame.frame.value);
  out.put(key_frame.stamp.ns);
  put_vector(out, key_frame.camera_from_world.rotation().coeffs());
  put_vector(out, key_frame.camera_from_world.translation());
  put_features(out, *key_frame.features);
}

void put_landmark(ByteWriter& out, const Landmark& landmark) {
  out.put(landmark.id.value);
  put_vector(out, landmark.position);
  // These follow from observations, but not all of those are there any more.
  put_vector(out, landmark.normal);
  out.put(landmark.min_distance_m), out.put(landmark.max_distance_m);
  put_vector(out, landmark.descriptor);
  out.put(landmark.first_key_frame.value);
  out.put(landmark.visible), out.put(landmark.found);
  out.put(static_cast<std::uint32_t>(landmark.observations.size()));
  for (const Observation& o : landmark.observations) out.put(o.key_frame.value), out.put(o.feature);
}

/// Reads what the functions above write; after an Error nothing more may be read.
class ContentReader {
 public:
  ContentReader(std::span<const std::uint8_t> bytes, const std::string& name) : in_(bytes), name_(name) {}

  Result<Map> read();

 private:
  Error invalid(const std::string& what) const { return {ErrorCode::kInvalidInput, name_ + ": " + what}; }
  /// A success as long as the bytes have lasted.
  Status lasted(const std::string& where) const {
    return in_.ended() ? Status(invalid("the map file breaks off in " + where)) : Status::success();
  }
  template <typename T>
  void get_into(T& value) {
    value = in_.get<T>();
  }

  Status read_model();
  Status read_key_frame(KeyFrame& key_frame);
  Status read_features(FrameFeatures& features, const std::string& where);
  Status read_mask(MaskRuns& mask, const std::string& where);
  Status read_landmark(Landmark& landmark);
  /// What is wrong with feature i; nullptr when nothing is.
  const char* fault_of_feature(const FrameFeatures& features, std::size_t i) const;
  static const char* fault_of_landmark(const Landmark& landmark);

  ByteReader in_;
  const std::string& name_;
  std::shared_ptr<const ObservationModel> model_;
};

Status ContentReader::read_model() {
  Camera camera;
  NoiseModel noise;
  visit_camera(camera, [this](auto& value) { get_into(value); });
  visit_noise(noise, [this](auto& value) { get_into(value); });
  std::vector<float> scales(in_.get_count(sizeof(float)));
  for (float& scale : scales) get_into(scale);
  if (Status s = lasted("its camera"); !s) return s;
  if (Status s = camera.check(); !s) return invalid(s.error().message);
  bool sound = true;
  visit_noise(noise, [&sound](double value) { sound = sound && std::isfinite(value) && value >= 0; });
  if (!sound || noise.pixel_sigma_px == 0 || noise.disparity_sigma_px == 0)
    return invalid("the noise model is not made of positive numbers");
  sound = !scales.empty() && scales.size() <= 256;  // a level is one byte
  for (std::size_t i = 0; i < scales.size(); ++i)
    sound = sound && std::isfinite(scales[i]) && scales[i] > (i == 0 ? 0.f : scales[i - 1]);
  if (!sound) return invalid("the scales of the pyramid levels are not positive numbers that grow");
  model_ = std::make_shared<ObservationModel>(camera, noise, std::move(scales));
  return Status::success();
}

Status ContentReader::read_key_frame(KeyFrame& key_frame) {
  get_into(key_frame.id.value);
  get_into(key_frame.frame.value);
  get_into(key_frame.stamp.ns);
  Eigen::Quaterniond rotation;
  for (double& value : rotation.coeffs()) get_into(value);
  const auto translation = get_vector<Eigen::Vector3d>(in_);
  const std::string where = fmt::format("key frame {}", key_frame.id.value);
  if (Status s = lasted(where); !s) return s;
  if (!translation.allFinite() || !(std::abs(rotation.norm() - 1) < kUnitTolerance))
    return invalid(where + " has a pose that is none");
  key_frame.camera_from_world = SE3::from_unit(rotation, translation);
  const auto features = std::make_shared<FrameFeatures>();
  if (Status s = read_features(*features, where); !s) return s;
  key_frame.features = features;
  return Status::success();
}

Status ContentReader::read_features(FrameFeatures& features, const std::string& where) {
  const std::size_t n = in_.get_count(kFeatureBytes);
  features.orb.keypoints.resize(n);
  features.orb.descriptors.resize(n);
  features.x_px.resize(n);
  features.y_px.resize(n);
  features.depth_m.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    visit_keypoint(features.orb.keypoints[i], [this](auto& value) { get_into(value); });
    for (std::uint64_t& word : features.orb.descriptors[i]) get_into(word);
    get_into(features.x_px[i]), get_into(features.y_px[i]), get_into(features.depth_m[i]);
    if (const char* fault = fault_of_feature(features, i))
      return invalid(fmt::format("feature {} of {} {}", i, where, fault));
  }
  if (Status s = read_mask(features.moving, where); !s) return s;
  features.grid.build(features.x_px, features.y_px, model_->camera().width_px, model_->camera().height_px);
  return Status::success();
}

const char* ContentReader::fault_of_feature(const FrameFeatures& features, std::size_t i) const {
  const Camera& camera = model_->camera();
  const Keypoint& k = features.orb.keypoints[i];
  if (!(k.x_px >= 0 && k.y_px >= 0 && k.x_px < static_cast<float>(camera.width_px) &&
        k.y_px < static_cast<float>(camera.height_px)))
    return "lies outside the image";
  if (k.level >= model_->levels()) return "is of a pyramid level that is not there";
  if (!std::isfinite(k.response) || !std::isfinite(k.angle_rad)) return "is not made of numbers";
  if (!std::isfinite(features.x_px[i]) || !std::isfinite(features.y_px[i])) return "has a pixel that is none";
  if (!std::isfinite(features.depth_m[i]) || features.depth_m[i] < 0) return "has a depth that is none";
  return nullptr;
}

Status ContentReader::read_mask(MaskRuns& mask, const std::string& where) {
  const cv::Size image(model_->camera().width_px, model_->camera().height_px);
  cv::Size size;
  get_into(size.width), get_into(size.height);
  const std::uint32_t runs = in_.get_count(kRunBytes);
  if (Status s = lasted(where); !s) return s;
  if (size != image && size != cv::Size()) return invalid("the mask of " + where + " is not of the image's size");
  std::vector<std::vector<MaskRuns::Run>> rows(static_cast<std::size_t>(size.height));
  for (std::uint32_t i = 0; i < runs; ++i) {
    const auto y = in_.get<std::uint16_t>();
    MaskRuns::Run run;
    get_into(run.begin), get_into(run.end);
    if (y >= rows.size()) return invalid("the mask of " + where + " has rows outside the image");
    rows[y].push_back(run);
  }
  std::optional<MaskRuns> read = MaskRuns::of_rows(size, rows);
  if (!read) return invalid("the mask of " + where + " is none");
  mask = std::move(*read);
  return Status::success();
}

Status ContentReader::read_landmark(Landmark& landmark) {
  get_into(landmark.id.value);
  landmark.position = get_vector<Eigen::Vector3d>(in_);
  landmark.normal = get_vector<Eigen::Vector3f>(in_);
  get_into(landmark.min_distance_m), get_into(landmark.max_distance_m);
  for (std::uint64_t& word : landmark.descriptor) get_into(word);
  get_into(landmark.first_key_frame.value);
  get_into(landmark.visible), get_into(landmark.found);
  landmark.observations.resize(in_.get_count(kObservationBytes));
  for (Observation& o : landmark.observations) get_into(o.key_frame.value), get_into(o.feature);
  const std::string where = fmt::format("landmark {}", landmark.id.value);
  if (Status s = lasted(where); !s) return s;
  if (const char* fault = fault_of_landmark(landmark)) return invalid(where + " " + fault);
  return Status::success();
}

const char* ContentReader::fault_of_landmark(const Landmark& landmark) {
  if (!landmark.position.allFinite()) return "has a position that is none";
  if (!(landmark.normal.norm() < 1 + 1e-3)) return "has a direction that is none";
  if (!(landmark.min_distance_m >= 0 && landmark.max_distance_m >= landmark.min_distance_m &&
        std::isfinite(landmark.max_distance_m)))
    return "has distances that are none";
  if (landmark.visible < 0 || landmark.found < 0 || landmark.visible > kMostSeen || landmark.found > kMostSeen)
    return "was seen in a number of frames that cannot be";
  for (std::size_t i = 1; i < landmark.observations.size(); ++i)
    if (landmark.observations[i].key_frame <= landmark.observations[i - 1].key_frame)
      return "has observations that are not in order";
  return nullptr;
}

Result<Map> ContentReader::read() {
  if (Status s = read_model(); !s) return s.error();
  MapContent content;
  get_into(content.next_key_frame.value);
  get_into(content.next_landmark.value);
  content.key_frames.resize(in_.get_count(kKeyFrameBytes));
  if (Status s = lasted("its key frames"); !s) return s.error();
  if (content.next_key_frame.value > kMostIds || content.next_landmark.value > kMostIds)
    return invalid("the next ids are too large to be true");
  for (KeyFrame& key_frame : content.key_frames)
    if (Status s = read_key_frame(key_frame); !s) return s.error();
  content.landmarks.resize(in_.get_count(kLandmarkBytes));
  if (Status s = lasted("its landmarks"); !s) return s.error();
  for (Landmark& landmark : content.landmarks)
    if (Status s = read_landmark(landmark); !s) return s.error();
  if (in_.left() > 0) return invalid(fmt::format("{} bytes follow the last landmark", in_.left()));
  Result<Map> map = Map::restore(model_, std::move(content));
  if (!map) return invalid(map.error().message);
  return map;
}

}  // namespace

std::string format_map_content(const Map& map) {
  ByteWriter out;
  const auto put = [&out](auto value) { out.put(value); };
  const ObservationModel& model = map.model();
  visit_camera(model.camera(), put);
  visit_noise(model.noise(), put);
  out.put(static_cast<std::uint32_t>(model.levels()));
  for (int level = 0; level < model.levels(); ++level) out.put(model.level_scale(level));
  out.put(map.next_key_frame().value);
  out.put(map.next_landmark().value);
  out.put(static_cast<std::uint32_t>(map.key_frames().size()));
  for (const auto& [id, key_frame] : map.key_frames()) put_key_frame(out, key_frame);
  out.put(static_cast<std::uint32_t>(map.landmark_count()));
  for (const LandmarkId id : map.landmark_ids()) put_landmark(out, *map.landmark(id));
  return out.take();
}

Result<Map> parse_map_content(std::span<const std::uint8_t> bytes, const std::string& name) {
  return ContentReader(bytes, name).read();
}

}  // namespace semvslam
