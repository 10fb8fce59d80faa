#include "semvslam/semantic/segmentation_repair.h"

#include <fmt/core.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace semvslam {
namespace {

constexpr std::string_view kPerson = "person";  // the class that the paper's rule counts

bool is_depth(const cv::Mat& depth, cv::Size size) {
  return depth.size() == size && (depth.type() == CV_16UC1 || depth.type() == CV_32FC1);
}

void add_note(std::string& notes, const std::string& note) { notes += (notes.empty() ? "" : "; ") + note; }

/// Instances whose mask does not fit their window or image would be read out of bounds.
bool is_sound(const Segmentation& s, cv::Size size) {
  return s.size == size && std::all_of(s.instances.begin(), s.instances.end(), [&](const Instance& i) {
           return !i.window.empty() && (i.window & cv::Rect({}, size)) == i.window && i.mask.type() == CV_8UC1 &&
                  i.mask.size() == i.window.size();
         });
}

}  // namespace

void RepairOptions::add_to(ConfigSchema& schema) {
  schema.add("repair.mode", &mode, {"off", "paste", "carry"},
             "missed segmentations: leave, paste the fullest recent mask (the paper), carry masks with a depth check");
  quality.add_to(schema);
  carry.add_to(schema);
  memory.add_to(schema);
  schema.add("repair.longest_pause_s", &longest_pause_s, {0.0, 1e6}, "a longer time between two frames starts anew, s");
}

Status RepairOptions::check() const { return quality.check(); }

struct SegmentationRepair::State {
  /// An earlier frame, for segmentations that come late.
  struct Moment {
    FrameId frame;
    CarryFrame images;
    std::optional<SE3> from_previous;  // this frame from the one before it
  };
  /// An earlier result as it came, for pasting.
  struct Raw {
    FrameId frame;
    int person_px = 0;
    std::vector<Instance> persons;
  };

  Camera camera;
  RepairOptions options;
  MissingSegmentationDetector detector;
  InstanceMemory memory;
  MaskCarry carry;
  std::deque<Moment> moments;
  std::deque<Raw> raw;
  FrameId last_frame;
  TimeStamp last_stamp;

  State(const Camera& c, const RepairOptions& o)
      : camera(c), options(o), detector(o.quality), memory(c, o.carry, o.memory), carry(c, o.carry) {}

  void reset() {
    detector.reset();
    memory.reset();
    moments.clear();
    raw.clear();
    last_frame = FrameId();
  }
  void check_order(const RepairInput& input, RepairRecord& record);
  CarryFrame images_of(const RepairInput& input, RepairRecord& record) const;
  const Segmentation* usable(const RepairInput& input, RepairRecord& record) const;
  std::optional<Segmentation> bring_forward(const Segmentation& late, const CarryFrame& present,
                                            const RepairInput& input) const;
  void paste(RepairedSegmentation& out) const;
  void remember(const RepairInput& input, const CarryFrame& present);
  void remember_raw(FrameId frame, int person_px, const Segmentation& segmentation);
};

void SegmentationRepair::State::check_order(const RepairInput& input, RepairRecord& record) {
  if (!last_frame.valid()) return;
  const double pause_s = static_cast<double>(input.stamp.ns - last_stamp.ns) * 1e-9;
  if (input.frame > last_frame && pause_s >= 0 && pause_s <= options.longest_pause_s) return;
  add_note(record.note, input.frame > last_frame ? fmt::format("{:.3f} s since the frame before: starts anew", pause_s)
                                                 : "not later than the frame before: starts anew");
  reset();
}

CarryFrame SegmentationRepair::State::images_of(const RepairInput& input, RepairRecord& record) const {
  const cv::Size size(camera.width_px, camera.height_px);
  cv::Mat gray = input.gray, depth = input.depth;
  if (!gray.empty() && (gray.size() != size || gray.type() != CV_8UC1)) {
    add_note(record.note, "gray image of another size or type: left out");
    gray = cv::Mat();
  }
  if (!depth.empty() && !is_depth(depth, size)) {
    add_note(record.note, "depth image of another size or type: left out");
    depth = cv::Mat();
  }
  return {camera, gray, depth};
}

const Segmentation* SegmentationRepair::State::usable(const RepairInput& input, RepairRecord& record) const {
  const Segmentation* given = input.segmentation;
  if (!given) return nullptr;
  const cv::Size size(camera.width_px, camera.height_px);
  if (!is_sound(*given, size)) {
    add_note(record.note, fmt::format("segmentation of {}x{} does not fit the image of {}x{}: left out",
                                      given->size.width, given->size.height, size.width, size.height));
    return nullptr;
  }
  if (given->frame.valid() && given->frame > input.frame) {
    add_note(record.note, "segmentation of a later frame: left out");
    return nullptr;
  }
  return given;
}

std::optional<Segmentation> SegmentationRepair::State::bring_forward(const Segmentation& late,
                                                                     const CarryFrame& present,
                                                                     const RepairInput& input) const {
  const auto at = std::find_if(moments.begin(), moments.end(), [&](const Moment& m) { return m.frame == late.frame; });
  if (at == moments.end()) return std::nullopt;
  std::optional<SE3> to_from = input.cur_from_prev;
  for (auto m = moments.end(); to_from && --m != at;)
    to_from = m->from_previous ? std::optional<SE3>(*to_from * *m->from_previous) : std::nullopt;
  Segmentation out{input.frame, input.stamp, late.size, {}};
  for (const Instance& i : late.instances) {
    const CarriedMask carried = carry.carry(at->images, present, i.window, i.mask, to_from);
    if (carried.outcome != CarryOutcome::kVisible) continue;
    Instance now = i;
    now.id = InstanceId(static_cast<std::uint32_t>(out.instances.size()));
    now.window = carried.window;
    now.box = cv::Rect2f(carried.window);
    now.mask = carried.mask;
    now.provenance = Provenance::kRestored;
    out.instances.push_back(std::move(now));
  }
  return out;
}

void SegmentationRepair::State::paste(RepairedSegmentation& out) const {
  const Raw* fullest = nullptr;
  for (const Raw& r : raw) {
    const std::uint32_t age = out.record.frame.value - r.frame.value;
    if (age > static_cast<std::uint32_t>(options.quality.history)) continue;
    if (!fullest || r.person_px >= fullest->person_px) fullest = &r;  // of equal ones the latest
  }
  if (!fullest || fullest->person_px <= out.record.quality.person_px) return;
  const int before = out.segmentation.pixels_of_class(kPerson);
  for (const Instance& i : fullest->persons) {
    out.segmentation.instances.push_back(i);
    out.segmentation.instances.back().id =
        InstanceId(static_cast<std::uint32_t>(out.segmentation.instances.size() - 1));
    out.segmentation.instances.back().provenance = Provenance::kRestored;
  }
  out.record.method = "paste";
  out.record.restored_instances = static_cast<int>(fullest->persons.size());
  out.record.restored_px = out.segmentation.pixels_of_class(kPerson) - before;
}

void SegmentationRepair::State::remember(const RepairInput& input, const CarryFrame& present) {
  last_frame = input.frame;
  last_stamp = input.stamp;
  moments.push_back({input.frame, present, input.cur_from_prev});
  while (moments.size() > static_cast<std::size_t>(options.memory.longest_carry)) moments.pop_front();
}

void SegmentationRepair::State::remember_raw(FrameId frame, int person_px, const Segmentation& segmentation) {
  while (raw.size() > static_cast<std::size_t>(options.quality.history)) raw.pop_front();
  raw.push_back({frame, person_px, {}});
  for (const Instance& i : segmentation.instances)
    if (i.class_name == kPerson) raw.back().persons.push_back(i);
}

SegmentationRepair::SegmentationRepair(const Camera& camera, const RepairOptions& options)
    : state_(std::make_unique<State>(camera, options)) {}
SegmentationRepair::~SegmentationRepair() = default;
SegmentationRepair::SegmentationRepair(SegmentationRepair&&) noexcept = default;
SegmentationRepair& SegmentationRepair::operator=(SegmentationRepair&&) noexcept = default;

void SegmentationRepair::reset() { state_->reset(); }

RepairedSegmentation SegmentationRepair::process(const RepairInput& input) {
  State& s = *state_;
  RepairedSegmentation out;
  RepairRecord& record = out.record;
  record.frame = input.frame;
  s.check_order(input, record);
  const CarryFrame present = s.images_of(input, record);
  out.segmentation = {input.frame, input.stamp, cv::Size(s.camera.width_px, s.camera.height_px), {}};
  const Segmentation* given = s.usable(input, record);
  std::optional<Segmentation> late;
  if (given && given->frame.valid() && given->frame < input.frame) {
    record.age_frames = static_cast<int>(input.frame.value - given->frame.value);
    late = s.bring_forward(*given, present, input);
    if (!late) add_note(record.note, fmt::format("segmentation is {} frames late: left out", record.age_frames));
    given = late ? &*late : nullptr;
  }
  record.missing = !given;
  if (given) {
    out.segmentation.instances = given->instances;
    record.quality = s.detector.step(input.frame, out.segmentation.pixels_of_class(kPerson));
  } else {
    record.quality = s.detector.missing();
  }
  const bool lacking = record.quality.state != SegmentationState::kQualified;
  if (s.options.mode == "paste") {
    if (given) s.remember_raw(input.frame, record.quality.person_px, out.segmentation);
    if (lacking) s.paste(out);
  } else if (s.options.mode == "carry") {
    const MemoryReport done = s.memory.step(present, input.cur_from_prev, lacking, out.segmentation);
    record.restored_instances = done.restored_instances;
    record.extended_instances = done.extended_instances;
    record.restored_px = done.restored_px;
    if (done.restored_instances + done.extended_instances > 0) record.method = "carry";
  }
  s.remember(input, present);
  return out;
}

}  // namespace semvslam
