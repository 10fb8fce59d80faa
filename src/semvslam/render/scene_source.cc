#include "semvslam/render/scene_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "semvslam/render/camera_path.h"
#include "semvslam/render/cast.h"
#include "semvslam/render/contact_shadow.h"
#include "semvslam/render/light_bake.h"
#include "semvslam/render/random.h"
#include "semvslam/render/rasterizer.h"
#include "semvslam/render/room.h"
#include "semvslam/render/sensor.h"

namespace semvslam {
namespace {

using namespace render;

constexpr std::int64_t kFirstStamp_ns = 1'000'000'000;
constexpr double kFocalOfWidth = 525.0 / 640.0;  // as common RGB-D cameras: 62.7 degrees across
constexpr int kBlurSteps = 6;

Status check_choice(const char* option, const std::string& value, const std::vector<std::string>& choices) {
  if (std::find(choices.begin(), choices.end(), value) != choices.end()) return Status::success();
  return invalid_input(fmt::format("scene option {}: '{}' is not one of {}", option, value, fmt::join(choices, ", ")));
}

Camera make_camera(const SceneOptions& options) {
  Camera camera;
  camera.width_px = options.width_px;
  camera.height_px = options.height_px;
  camera.fx_px = camera.fy_px = kFocalOfWidth * options.width_px;
  camera.cx_px = (options.width_px - 1) / 2.0;
  camera.cy_px = (options.height_px - 1) / 2.0;
  camera.frame_rate_hz = options.frame_rate_hz;
  return camera;
}

}  // namespace

Status SceneOptions::check() const {
  if (Status s = check_choice("people", people, {"walking", "sitting", "none", "carrying"}); !s) return s;
  if (Status s = check_choice("motion", motion, {"xyz", "rpy", "halfsphere", "static", "tour"}); !s) return s;
  if (width_px < 16 || width_px > 8192 || height_px < 16 || height_px > 8192) {
    return invalid_input(fmt::format("scene size {}x{}: both sides must be in 16..8192 pixels", width_px, height_px));
  }
  if (frames < 1 || frames > 10'000'000)
    return invalid_input(fmt::format("scene option frames: {} is not in 1..10000000", frames));
  if (!(frame_rate_hz >= 0.1 && frame_rate_hz <= 1000)) {
    return invalid_input(fmt::format("scene option frame_rate_hz: {} is not in 0.1..1000", frame_rate_hz));
  }
  if (threads < 1 || threads > 256)
    return invalid_input(fmt::format("scene option threads: {} is not in 1..256", threads));
  return Status::success();
}

struct RenderedScene::Impl {
  explicit Impl(const SceneOptions& chosen)
      : options(chosen),
        camera(make_camera(chosen)),
        path(chosen.motion, chosen.seed),
        rasterizer(camera),
        sensor(camera) {
    SceneBuilder builder;
    const Room room = build_room(builder, options.seed);
    cast = std::make_unique<Cast>(options.people, options.seed, room.seats, builder, options.threads);
    scene = builder.finish(options.threads);
    cast->take_items(scene);
    light = std::make_unique<LightModel>(room.lights);
    bake_light(scene, *light, options.threads);
    shadow = std::make_unique<ContactShadow>(scene.light);
    for (const Cast::Role& role : cast->roles()) roles.push_back({role.name, role.person ? "person" : "object", true});
  }

  double time_s(std::size_t index) const { return static_cast<double>(index) / options.frame_rate_hz; }
  TimeStamp stamp(std::size_t index) const { return {kFirstStamp_ns + std::llround(1e9 * time_s(index))}; }
  void draw(double time, Picture& picture);
  void draw_blurred(double time, Picture& picture);

  SceneOptions options;
  Camera camera;
  CameraPath path;
  Rasterizer rasterizer;
  SensorModel sensor;
  StaticScene scene;
  std::unique_ptr<Cast> cast;
  std::unique_ptr<LightModel> light;
  std::unique_ptr<ContactShadow> shadow;
  std::vector<Mesh> moving;
  std::vector<Occluder> occluders;
  std::vector<SceneRole> roles;
  Picture picture, exposure;
};

void RenderedScene::Impl::draw(double time, Picture& out) {
  const SE3 world_from_camera = path.pose(time);
  cast->arrange(time, world_from_camera.translation(), *light, moving, occluders, options.threads);
  shadow->update(scene.patches, occluders);
  std::vector<const Mesh*> meshes;
  for (const Mesh& mesh : scene.meshes) meshes.push_back(&mesh);
  for (const Mesh& mesh : moving) meshes.push_back(&mesh);
  rasterizer.draw(meshes, scene.textures, shadow->current(), world_from_camera, options.threads, out);
}

/// The mean of pictures spread evenly around the stamp; depth and masks stay those of the stamp.
void RenderedScene::Impl::draw_blurred(double time, Picture& out) {
  const double exposure_s = 0.5 / options.frame_rate_hz;
  cv::Mat sum(camera.height_px, camera.width_px, CV_32FC3, cv::Scalar::all(0));
  for (int i = 0; i < kBlurSteps; ++i) {
    draw(time + exposure_s * ((i + 0.5) / kBlurSteps - 0.5), exposure);
    cv::accumulate(exposure.colour, sum);
  }
  draw(time, out);
  sum.convertTo(out.colour, CV_8UC3, 1.0 / kBlurSteps);
}

RenderedScene::RenderedScene(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RenderedScene::~RenderedScene() = default;
RenderedScene::RenderedScene(RenderedScene&&) noexcept = default;
RenderedScene& RenderedScene::operator=(RenderedScene&&) noexcept = default;

Result<RenderedScene> RenderedScene::create(const SceneOptions& options) {
  if (Status status = options.check(); !status) return status.error();
  return RenderedScene(std::make_unique<Impl>(options));
}

const Camera& RenderedScene::camera() const { return impl_->camera; }
const SceneOptions& RenderedScene::options() const { return impl_->options; }
const std::vector<SceneRole>& RenderedScene::roles() const { return impl_->roles; }

RenderedFrame RenderedScene::render(std::size_t index) {
  Impl& s = *impl_;
  const double time = s.time_s(index);
  const bool blurred = s.options.motion_blur;
  blurred ? s.draw_blurred(time, s.picture) : s.draw(time, s.picture);
  RenderedFrame out;
  out.frame.id = FrameId(static_cast<std::uint32_t>(index));
  out.frame.stamp = s.stamp(index);
  out.world_from_camera = s.path.pose(time);
  if (s.options.noise) {
    const std::uint64_t frame_seed = mix64(s.options.seed, 1000 + index);
    out.frame.depth = s.sensor.measure_depth(s.picture, frame_seed, s.options.threads);
    s.sensor.disturb_colour(s.picture.colour, frame_seed, s.options.threads);
  } else {
    out.frame.depth = s.picture.depth_m.clone();
  }
  out.frame.colour = s.picture.colour.clone();
  cv::cvtColor(out.frame.colour, out.frame.gray, cv::COLOR_BGR2GRAY);
  out.instances = s.picture.instances.clone();
  return out;
}

Trajectory RenderedScene::ground_truth() const {
  Trajectory poses;
  for (int i = 0; i < impl_->options.frames; ++i)
    poses.push_back({impl_->stamp(i), impl_->path.pose(impl_->time_s(i))});
  return poses;
}

namespace {

class SceneFrameSource : public FrameSource {
 public:
  SceneFrameSource(RenderedScene scene, bool with_mask) : scene_(std::move(scene)), with_mask_(with_mask) {}

  Result<std::optional<RgbdFrame>> next() override {
    if (next_ >= static_cast<std::size_t>(scene_.options().frames)) return std::optional<RgbdFrame>();
    RenderedFrame rendered = scene_.render(next_++);
    if (with_mask_) {
      cv::Mat table(1, 256, CV_8UC1, cv::Scalar(0));
      for (std::size_t i = 0; i < scene_.roles().size(); ++i)
        table.at<std::uint8_t>(static_cast<int>(i) + 1) = scene_.roles()[i].moves ? 255 : 0;
      cv::LUT(rendered.instances, table, rendered.frame.mask);
    }
    return std::optional<RgbdFrame>(std::move(rendered.frame));
  }
  const Camera& camera() const override { return scene_.camera(); }
  std::optional<std::size_t> size() const override { return scene_.options().frames; }
  std::string description() const override {
    const SceneOptions& o = scene_.options();
    return fmt::format("rendered scene: people {}, camera {}, {}x{}, {} frames at {} Hz, seed {}{}", o.people, o.motion,
                       o.width_px, o.height_px, o.frames, o.frame_rate_hz, o.seed, o.noise ? "" : ", no noise");
  }

 private:
  RenderedScene scene_;
  bool with_mask_;
  std::size_t next_ = 0;
};

}  // namespace

Result<std::unique_ptr<FrameSource>> open_scene(const SceneOptions& options, bool truth_mask_as_frame_mask) {
  auto scene = RenderedScene::create(options);
  if (!scene) return scene.error();
  return std::unique_ptr<FrameSource>(
      std::make_unique<SceneFrameSource>(std::move(scene).value(), truth_mask_as_frame_mask));
}

}  // namespace semvslam
