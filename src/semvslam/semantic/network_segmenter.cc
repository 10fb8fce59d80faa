#include "semvslam/semantic/network_segmenter.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "semvslam/semantic/image_input.h"

namespace semvslam {
namespace {

constexpr float kLeastProposalSide = 4, kLeastObjectSide = 2;  // px of the network's input

bool finite(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

/// A box of the network's input in the image that was fitted into it; the part on the filling is cut off.
DetectionBox in_image(const DetectionBox& box, float scale_x, float scale_y, cv::Size image) {
  const auto width = static_cast<float>(image.width), height = static_cast<float>(image.height);
  const DetectionBox b = box.unscaled(scale_x, scale_y);
  return {std::min(b.x0, width), std::min(b.y0, height), std::min(b.x1, width), std::min(b.y1, height)};
}

Error not_finite(const char* what) {
  return {ErrorCode::kInternal, std::string("the network gives numbers that are not finite in its ") + what};
}

}  // namespace

NetworkSegmenter::NetworkSegmenter(std::unique_ptr<NetworkGraphs> graphs, ModelDescription model, Limits limits,
                                   RoleTable roles, StageTimers* timers)
    : graphs_(std::move(graphs)),
      model_(std::move(model)),
      limits_(limits),
      roles_(std::move(roles)),
      timers_(timers ? *timers : own_timers_) {
  for (std::size_t l = 0; l < anchors_.size(); ++l)
    anchors_[l] = make_anchors(model_.input.height / model_.strides[l], model_.input.width / model_.strides[l],
                               model_.strides[l], model_.anchor_sizes[l], model_.anchor_ratios);
}

Result<Segmentation> NetworkSegmenter::segment(const SegmentationRequest& request) {
  Result<cv::Mat> bgr = to_bgr8(request.image);
  if (!bgr) return bgr.error();
  Segmentation out{request.frame, request.stamp, bgr->size(), {}};
  FittedImage fitted;
  {
    const auto lap = timers_["segment.prepare"].time();
    fitted = fit_image(*bgr, model_.input, model_.pad, input_);
  }
  Result<TrunkOutput> trunk = [&] {
    const auto lap = timers_["segment.trunk"].time();
    return graphs_->trunk(fitted.image);
  }();
  if (!trunk) return trunk.error();
  const Result<std::vector<DetectionBox>> proposals = propose(*trunk);
  if (!proposals) return proposals.error();
  const Result<std::vector<Object>> objects = classify(*trunk, *proposals);
  if (!objects) return objects.error();
  if (const Status s = draw(*trunk, *objects, fitted.scale_x, fitted.scale_y, out); !s) return s.error();
  return out;
}

Result<std::vector<DetectionBox>> NetworkSegmenter::propose(const TrunkOutput& trunk) const {
  const auto lap = timers_["segment.proposals"].time();
  std::vector<DetectionBox> boxes;
  std::vector<float> scores;
  for (std::size_t l = 0; l < trunk.levels.size(); ++l) {
    if (!finite(trunk.levels[l].objectness)) return not_finite("objectness");
    for (const int i : largest(trunk.levels[l].objectness, limits_.proposals_per_level)) {
      const float* deltas = &trunk.levels[l].deltas[static_cast<std::size_t>(i) * 4];
      if (!finite({deltas, 4})) return not_finite("proposals");
      const DetectionBox box = decode_box(deltas, anchors_[l][i], {1, 1, 1, 1}, static_cast<float>(model_.input.width),
                                          static_cast<float>(model_.input.height));
      if (box.width() < kLeastProposalSide || box.height() < kLeastProposalSide) continue;
      boxes.push_back(box);
      scores.push_back(trunk.levels[l].objectness[i]);
    }
  }
  std::vector<DetectionBox> out;
  for (const int i : suppress_overlaps(boxes, scores, limits_.proposal_overlap, NetworkGraphs::kBoxBatch))
    out.push_back(boxes[i]);
  return out;
}

void NetworkSegmenter::align_region(const TrunkOutput& trunk, const DetectionBox& box, std::span<const float> levels,
                                    int cells, float* to) const {
  roi_align(trunk.levels[roi_level(box, levels)].features, model_.channels, box, cells, to);
}

Result<std::vector<NetworkSegmenter::Object>> NetworkSegmenter::classify(const TrunkOutput& trunk,
                                                                         const std::vector<DetectionBox>& proposals) {
  const auto lap = timers_["segment.boxes"].time();
  std::vector<Object> found;
  if (proposals.empty()) return found;
  const std::span<float> input = graphs_->box_input();
  const std::size_t region = input.size() / NetworkGraphs::kBoxBatch;
  for (std::size_t n = 0; n < proposals.size(); ++n)
    align_region(trunk, proposals[n], model_.box_levels, NetworkGraphs::kBoxCells, &input[n * region]);
  std::fill(input.begin() + static_cast<std::ptrdiff_t>(proposals.size() * region), input.end(), 0.f);
  const Result<BoxHeadOutput> head = graphs_->box_head();
  if (!head) return head.error();
  const std::size_t classes = model_.classes.size();
  const auto used_p = head->probabilities.first(proposals.size() * (classes + 1)),
             used_d = head->deltas.first(proposals.size() * 4);
  if (!finite(used_p) || !finite(used_d)) return not_finite("classes or boxes");

  std::vector<std::vector<Object>> by_class(classes);
  for (std::size_t n = 0; n < proposals.size(); ++n) {
    const DetectionBox box =
        decode_box(&used_d[n * 4], proposals[n], model_.box_weights, static_cast<float>(model_.input.width),
                   static_cast<float>(model_.input.height));
    if (box.width() < kLeastObjectSide || box.height() < kLeastObjectSide) continue;
    for (std::size_t c = 0; c < classes; ++c)
      if (const float p = used_p[n * (classes + 1) + c + 1]; p >= limits_.score)
        by_class[c].push_back({box, static_cast<int>(c), p});
  }
  for (const std::vector<Object>& candidates : by_class) {
    std::vector<DetectionBox> boxes;
    std::vector<float> scores;
    for (const Object& o : candidates) {
      boxes.push_back(o.box);
      scores.push_back(o.score);
    }
    for (const int i : suppress_overlaps(boxes, scores, limits_.object_overlap, limits_.objects))
      found.push_back(candidates[i]);
  }
  std::stable_sort(found.begin(), found.end(), [](const Object& a, const Object& b) { return a.score > b.score; });
  if (std::ssize(found) > limits_.objects) found.resize(static_cast<std::size_t>(limits_.objects));
  return found;
}

SemanticHint NetworkSegmenter::semantic_hint(const TrunkOutput& trunk, float scale_x, float scale_y) const {
  const FeatureMap& finest = trunk.levels[0].features;
  const auto stride = static_cast<float>(finest.stride);
  return {trunk.semantic.data(), finest.rows,      finest.columns,       TrunkOutput::kSemanticChannels,
          scale_x / stride,      scale_y / stride, model_.semantic_share};
}

Result<NetworkSegmenter::RefinedMask> NetworkSegmenter::refine(MaskGraphs& graphs, const TrunkOutput& trunk,
                                                               const MaskGrid& mask, float score, float threshold,
                                                               const SemanticHint* hint) const {
  const DetectionBox region = mask.box.grown(model_.refine_margin);
  const RefineInput input = graphs.refine_input();
  sample_mask(mask, region, model_.refine_side, hint, input.logits.data());
  // Of the mask before: a refined one is surer of itself, but ranks objects no better.
  const float certainty = mean_inside(input.logits, threshold);
  if (!(score * certainty >= limits_.score)) return RefinedMask{};
  bend_logits(input.logits, threshold);
  roi_align(trunk.fine, model_.fine_channels, region, model_.refine_side, input.features.data());
  const Result<std::span<const float>> refined = graphs.refine_head();
  if (!refined) return refined.error();
  if (!finite(*refined)) return not_finite("refined masks");
  return RefinedMask{{refined->data(), model_.refine_side, region}, certainty};
}

Result<PastedMask> NetworkSegmenter::paste(MaskGraphs& graphs, const TrunkOutput& trunk, const Object& object,
                                           float scale_x, float scale_y, cv::Size image) const {
  align_region(trunk, object.box, model_.mask_levels, NetworkGraphs::kMaskCells, graphs.mask_input().data());
  const Result<std::span<const float>> masks = graphs.mask_head();
  if (!masks) return masks.error();
  constexpr std::size_t kPixels = static_cast<std::size_t>(NetworkGraphs::kMaskSide) * NetworkGraphs::kMaskSide;
  const bool person = object.class_index == 0;
  const std::span<const float> mask = masks->subspan(person ? 0 : kPixels, kPixels);  // persons have their own channel
  if (!finite(mask)) return not_finite("masks");
  const float threshold = person ? model_.mask_threshold : 0.5f;
  if (model_.refine.empty()) {
    const SemanticHint hint = semantic_hint(trunk, scale_x, scale_y);
    return paste_mask({mask.data(), NetworkGraphs::kMaskSide, in_image(object.box, scale_x, scale_y, image)}, image,
                      threshold, person ? &hint : nullptr);
  }
  const SemanticHint hint = semantic_hint(trunk, 1, 1);
  Result<RefinedMask> refined = refine(graphs, trunk, {mask.data(), NetworkGraphs::kMaskSide, object.box}, object.score,
                                       threshold, person ? &hint : nullptr);
  if (!refined) return refined.error();
  if (refined->certainty == 0) return PastedMask{};
  refined->grid.box = refined->grid.box.unscaled(scale_x, scale_y);
  PastedMask pasted = paste_mask(refined->grid, image);
  if (pasted.certainty > 0) pasted.certainty = refined->certainty;
  return pasted;
}

Result<std::vector<PastedMask>> NetworkSegmenter::paste_all(const TrunkOutput& trunk,
                                                            const std::vector<Object>& objects, float scale_x,
                                                            float scale_y, cv::Size image) {
  const std::span<MaskGraphs* const> graphs = graphs_->mask_graphs();
  std::vector<PastedMask> pasted(objects.size());
  std::vector<Status> ended(graphs.size(), Status::success());
  const auto work = [&](std::size_t lane) {
    for (std::size_t n = lane; n < objects.size() && ended[lane]; n += graphs.size()) {
      Result<PastedMask> one = paste(*graphs[lane], trunk, objects[n], scale_x, scale_y, image);
      if (one)
        pasted[n] = std::move(*one);
      else
        ended[lane] = one.error();
    }
  };
  const std::size_t beside = objects.empty() ? 0 : std::min(graphs.size(), objects.size()) - 1;
  std::deque<SideTaskGuard> guards;
  while (guards.size() < beside) {
    const std::size_t lane = guards.size() + 1;
    if (beside_.size() < lane) beside_.push_back(std::make_unique<SideTask>());
    guards.emplace_back(*beside_[lane - 1]);
    beside_[lane - 1]->start([&work, lane] { work(lane); });
  }
  work(0);
  for (std::size_t k = 0; k < beside; ++k) beside_[k]->wait();
  for (const Status& s : ended)
    if (!s) return s.error();
  return pasted;
}

Status NetworkSegmenter::draw(const TrunkOutput& trunk, const std::vector<Object>& objects, float scale_x,
                              float scale_y, Segmentation& out) {
  const auto lap = timers_["segment.masks"].time();
  if (!finite(trunk.semantic)) return not_finite("semantic map");
  const Result<std::vector<PastedMask>> masks = paste_all(trunk, objects, scale_x, scale_y, out.size);
  if (!masks) return masks.error();
  for (std::size_t n = 0; n < objects.size(); ++n) {
    const Object& o = objects[n];
    const PastedMask& pasted = (*masks)[n];
    // With how sure its mask is (the "maskness" of X. Wang et al., SOLOv2, 2020) the score tells good objects from
    // doubtful ones better than by the box head alone.
    const float score = o.score * pasted.certainty;
    if (!(score >= limits_.score) || pasted.certainty == 0) continue;
    Instance i;
    i.class_index = o.class_index;
    i.class_name = model_.classes[static_cast<std::size_t>(o.class_index)];
    i.role = roles_.role(i.class_name);
    i.score = score;
    const DetectionBox box = in_image(o.box, scale_x, scale_y, out.size);
    i.box = {box.x0, box.y0, box.width(), box.height()};
    i.window = pasted.window;
    i.mask = pasted.mask;
    out.instances.push_back(std::move(i));
  }
  std::stable_sort(out.instances.begin(), out.instances.end(),
                   [](const Instance& a, const Instance& b) { return a.score > b.score; });
  for (std::size_t n = 0; n < out.instances.size(); ++n)
    out.instances[n].id = InstanceId(static_cast<std::uint32_t>(n));
  return Status::success();
}

}  // namespace semvslam
