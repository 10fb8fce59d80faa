#include "semvslam/render/furniture.h"

#include <algorithm>
#include <cmath>

#include "semvslam/render/paint.h"

namespace semvslam::render {
namespace {

constexpr int kSpinesPerImage = 32;

/// The skin that shows one part (x, y, width, height as shares of the image, y from the top) on a surface of a given
/// size.
Skin part_of(std::uint16_t texture, double x, double y, double width, double height, double surface_width_m,
             double surface_height_m) {
  const Eigen::Vector2d image(surface_width_m / width, surface_height_m / height);
  return {texture, image, {x * image.x(), (1 - y - height) * image.y()}, false};
}

}  // namespace

SE3 on_plan(double x_m, double y_m, double z_m, double turn_deg) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn_deg * M_PI / 180, Eigen::Vector3d::UnitZ())), {x_m, y_m, z_m}};
}

Furnisher::Furnisher(SceneBuilder& builder, std::uint64_t seed) : builder_(builder), random_(mix64(seed, 71)) {
  dark_wood_ = builder.add_texture([s = random_.bits32()] { return paint_wood({512, 512}, {48, 78, 118}, 1, s); });
  light_wood_ = builder.add_texture([s = random_.bits32()] { return paint_wood({512, 512}, {128, 172, 212}, 1, s); });
  white_ = builder.add_texture([s = random_.bits32()] {
    return paint_material({256, 256}, {214, 218, 220}, 0.08f, s);
  });
  black_ = builder.add_texture([s = random_.bits32()] { return paint_material({256, 256}, {40, 38, 37}, 0.35f, s); });
  grey_ = builder.add_texture([s = random_.bits32()] { return paint_material({256, 256}, {128, 124, 120}, 0.2f, s); });
  metal_ = builder.add_texture([s = random_.bits32()] {
    return paint_material({256, 256}, {165, 165, 162}, 0.15f, s);
  });
  terracotta_ = builder.add_texture([s = random_.bits32()] {
    return paint_material({256, 256}, {70, 100, 170}, 0.3f, s);
  });
  paper_edge_ = builder.add_texture([s = random_.bits32()] { return paint_wood({256, 64}, {185, 205, 215}, 1, s); });
  for (auto& id : fabric_) {
    const double hue = random_.uniform();
    id = builder.add_texture([hue, value = random_.uniform(0.25, 0.6), s = random_.bits32()] {
      return paint_fabric({256, 256}, hue_colour(hue, 0.5, value), hue_colour(hue, 0.6, 0.3), s);
    });
  }
  for (auto& id : leaf_) id = builder.add_texture([s = random_.bits()] { return paint_leaf({64, 256}, s); }, false);
  for (auto& id : spines_)
    id = builder.add_texture([s = random_.bits()] { return paint_spines({2048, 256}, kSpinesPerImage, s); }, false);
  for (auto& id : carton_) id = builder.add_texture([s = random_.bits()] { return paint_cardboard({512, 512}, s); });
  for (auto& id : label_) id = builder.add_texture([s = random_.bits()] { return paint_label({256, 128}, s); });
  for (auto& id : page_) id = builder.add_texture([s = random_.bits()] { return paint_page({512, 724}, s); }, false);
  keyboard_ = builder.add_texture([s = random_.bits()] { return paint_keyboard({512, 192}, s); }, false);
}

Skin Furnisher::wood(bool dark, bool turned) {
  return {dark ? dark_wood_ : light_wood_, {1.3, 0.6}, {random_.uniform(0, 5), random_.uniform(0, 5)}, turned};
}

void Furnisher::row_of_books(const SE3& pose, double width_m, double height_m, double depth_m) {
  double x = -width_m / 2;
  const double usual = random_.uniform(0.62, 0.85) * height_m;
  while (true) {
    const double thick = random_.uniform(0.018, 0.05),
                 tall = std::min(height_m * 0.96, usual * random_.uniform(0.82, 1.12));
    if (x + thick > width_m / 2) break;
    const double deep = depth_m * random_.uniform(0.65, 0.9);
    const int number = random_.below(kSpinesPerImage);
    const std::uint16_t image = spines_[random_.below(3)];
    const Skin spine =
        part_of(image, static_cast<double>(number) / kSpinesPerImage, 0, 1.0 / kSpinesPerImage, 1, thick, tall);
    Skin cover = part_of(image, (number + 0.1) / kSpinesPerImage, 0.02, 0.06 / kSpinesPerImage, 0.02, deep, tall);
    const double front = -depth_m / 2 + random_.uniform(0.005, 0.04);
    builder_.box(pose * on_plan(x + thick / 2, front + deep / 2), {thick * 0.97, deep, tall}, cover, spine,
                 plain(paper_edge_), false);
    x += thick;
  }
}

void Furnisher::books_on_board(const SE3& pose, double width_m, double height_m, double depth_m) {
  double x = -width_m / 2 + 0.01;
  while (x < width_m / 2 - 0.12) {
    const double room = width_m / 2 - x;
    const double part = std::min(room, random_.uniform(0.16, 0.5));
    const SE3 here = pose * on_plan(x + part / 2, 0);
    const double what = random_.uniform();
    if (what < 0.68)
      row_of_books(here, part - 0.01, height_m, depth_m);
    else if (what < 0.78)
      book_stack(here, 3 + random_.below(4));
    else if (what < 0.88)
      carton(here, {part * 0.8, depth_m * 0.7, height_m * random_.uniform(0.4, 0.8)});
    else if (what < 0.94)
      plant(here, height_m * 0.85);
    else
      bottle(here);
    x += part;
  }
}

void Furnisher::bookshelf(const SE3& pose, double width_m, double height_m, double depth_m, int boards) {
  const bool dark = random_.chance(0.5);
  const double t = 0.02, gap = (height_m - t) / boards;
  builder_.begin_mesh();
  builder_.box(pose * on_plan(-width_m / 2 + t / 2, 0), {t, depth_m, height_m}, wood(dark, true));
  builder_.box(pose * on_plan(width_m / 2 - t / 2, 0), {t, depth_m, height_m}, wood(dark, true));
  builder_.box(pose * on_plan(0, depth_m / 2 - 0.006), {width_m - 2 * t, 0.01, height_m}, wood(dark));
  for (int i = 0; i <= boards; ++i) {
    builder_.box(pose * on_plan(0, -0.002, i * gap), {width_m - 2 * t, depth_m - 0.015, t}, wood(dark));
  }
  for (int i = 0; i < boards; ++i) {
    builder_.begin_mesh();
    books_on_board(pose * on_plan(0, -0.01, i * gap + t), width_m - 2 * t - 0.01, gap - t - 0.02, depth_m - 0.03);
  }
}

void Furnisher::cabinet(const SE3& pose, const Eigen::Vector3d& size_m, int doors) {
  builder_.begin_mesh();
  const bool dark = random_.chance(0.4);
  builder_.box(pose, size_m, wood(dark, true), wood(dark), wood(dark));
  const double width = size_m.x() / doors;
  for (int i = 0; i < doors; ++i) {
    const double x = -size_m.x() / 2 + (i + 0.5) * width;
    builder_.box(pose * on_plan(x, -size_m.y() / 2 - 0.009, 0.05), {width - 0.012, 0.016, size_m.z() - 0.08},
                 wood(dark, random_.chance(0.5)));
    builder_.box(pose * on_plan(x + (i % 2 ? -1 : 1) * (width / 2 - 0.05), -size_m.y() / 2 - 0.03, size_m.z() * 0.5),
                 {0.014, 0.025, 0.12}, plain(metal_));
  }
}

void Furnisher::desk(const SE3& pose, double width_m, double depth_m, double height_m) {
  builder_.begin_mesh();
  builder_.box(pose * on_plan(0, 0, height_m - 0.03), {width_m, depth_m, 0.03}, wood(false));
  for (const double x : {-width_m / 2 + 0.05, width_m / 2 - 0.05}) {
    for (const double y : {-depth_m / 2 + 0.05, depth_m / 2 - 0.05}) {
      builder_.box(pose * on_plan(x, y), {0.05, 0.05, height_m - 0.03}, plain(metal_));
    }
  }
  builder_.box(pose * on_plan(width_m / 2 - 0.28, 0.02, 0.08), {0.4, depth_m - 0.15, height_m - 0.13}, plain(white_));
  for (int i = 0; i < 3; ++i) {
    builder_.box(pose * on_plan(width_m / 2 - 0.28, -depth_m / 2 + 0.085, 0.1 + i * 0.19), {0.38, 0.02, 0.175},
                 plain(grey_));
  }
}

void Furnisher::office_chair(const SE3& pose) {
  builder_.begin_mesh();
  const std::uint16_t cloth = fabric_[random_.below(3)];
  const Skin cover{cloth, {0.25, 0.25}, {0, 0}, false};
  builder_.lathe(pose * on_plan(0, 0, 0.10), {{0.028, 0}, {0.028, 0.3}}, 10, plain(metal_));
  for (int i = 0; i < 5; ++i) {
    const SE3 spoke = pose * on_plan(0, 0, 0.06, 72.0 * i + 20);
    builder_.box(spoke * on_plan(0, -0.15), {0.045, 0.26, 0.035}, plain(black_));
    builder_.lathe(spoke * on_plan(0, -0.26, -0.06), {{0.001, 0}, {0.026, 0.01}, {0.026, 0.045}, {0.001, 0.055}}, 8,
                   plain(black_));
  }
  // Seat and back are cushions: solids with rounded rims.
  builder_.box(pose * on_plan(0, 0, 0.40), {0.44, 0.43, 0.055}, cover);
  builder_.box(pose * on_plan(0, 0, 0.455), {0.40, 0.39, 0.012}, cover);
  const SE3 back = pose * on_plan(0, 0.225, 0.55) *
                   SE3(Eigen::Quaterniond(Eigen::AngleAxisd(-0.16, Eigen::Vector3d::UnitX())), {0, 0, 0});
  builder_.box(back, {0.42, 0.05, 0.46}, cover);
  builder_.box(back * on_plan(0, -0.02, 0.03), {0.37, 0.05, 0.40}, cover);
  builder_.box(pose * on_plan(0, 0.235, 0.36), {0.06, 0.02, 0.28}, plain(black_));
  for (const double x : {-0.25, 0.25}) {
    builder_.box(pose * on_plan(x, 0.02, 0.42), {0.025, 0.05, 0.22}, plain(black_));
    builder_.box(pose * on_plan(x, 0.0, 0.64), {0.055, 0.26, 0.03}, plain(black_));
  }
}

void Furnisher::sofa(const SE3& pose, double width_m) {
  builder_.begin_mesh();
  const Skin cover{fabric_[random_.below(3)], {0.4, 0.4}, {0, 0}, false};
  builder_.box(pose * on_plan(0, 0, 0.05), {width_m, 0.8, 0.25}, cover);
  builder_.box(pose * on_plan(0, 0.31, 0.28), {width_m - 0.1, 0.2, 0.52}, cover);
  for (const double side : {-1.0, 1.0})
    builder_.box(pose * on_plan(side * (width_m / 2 - 0.09), 0, 0.05), {0.18, 0.8, 0.54}, cover);
  const int seats = std::max(1, static_cast<int>(width_m / 0.7));
  const double part = (width_m - 0.4) / seats;
  for (int i = 0; i < seats; ++i) {
    const double x = -width_m / 2 + 0.2 + (i + 0.5) * part;
    builder_.box(pose * on_plan(x, -0.08, 0.30), {part - 0.02, 0.62, 0.14}, cover);
    const double turn_deg = random_.uniform(-20, 20), aside = random_.uniform(-0.1, 0.1);
    const SE3 pillow = pose * on_plan(x + aside, 0.13, 0.45, turn_deg) *
                       SE3(Eigen::Quaterniond(Eigen::AngleAxisd(-0.35, Eigen::Vector3d::UnitX())), {0, 0, 0});
    builder_.box(pillow, {0.38, 0.1, 0.34}, Skin{fabric_[random_.below(3)], {0.22, 0.22}, {0, 0}, false});
  }
}

void Furnisher::monitor(const SE3& pose, double width_m) {
  builder_.begin_mesh();
  const double height = width_m * 0.6;
  const std::uint16_t screen = builder_.add_texture(
      [s = random_.bits()] {
        return paint_screen({512, 320}, s);
      },
      false);
  builder_.box(pose, {0.2, 0.16, 0.012}, plain(black_));
  builder_.box(pose * on_plan(0, 0.02, 0.01), {0.045, 0.03, 0.2}, plain(black_));
  const SE3 head = pose * on_plan(0, -0.01, 0.12);
  builder_.box(head, {width_m, 0.035, height}, plain(black_));
  const Eigen::Matrix3d r = head.rotation_matrix();
  const double rim = 0.012;
  builder_.quad(head * Eigen::Vector3d(-width_m / 2 + rim, -0.0185, rim), r * Eigen::Vector3d(width_m - 2 * rim, 0, 0),
                r * Eigen::Vector3d(0, 0, height - 2 * rim), Skin{screen, {0, 0}, {0, 0}, false}, 0.1, true);
}

void Furnisher::keyboard(const SE3& pose) {
  builder_.begin_mesh();
  const Skin top{keyboard_, {0, 0}, {0, 0}, false};
  builder_.box(pose, {0.42, 0.14, 0.02}, plain(black_), plain(black_), top);
  const double turn_deg = random_.uniform(-15, 15), ahead = random_.uniform(-0.02, 0.02);
  builder_.box(pose * on_plan(0.29, ahead, 0, turn_deg), {0.055, 0.1, 0.03}, plain(black_));
}

void Furnisher::plant(const SE3& pose, double height_m) {
  builder_.begin_mesh();
  const double pot = height_m * 0.28, r = pot * 0.5;
  builder_.lathe(
      pose, {{0.001, 0.001}, {r * 0.75, 0.001}, {r, pot}, {r * 1.06, pot}, {r * 0.9, pot * 0.97}, {0.001, pot * 0.9}},
      16, plain(terracotta_));
  const int leaves = 14 + random_.below(12);
  for (int i = 0; i < leaves; ++i) {
    const double a = 2.399963 * i + random_.uniform(-0.3, 0.3), rise = random_.uniform(0.6, 2.4);
    const Eigen::Vector3d direction = Eigen::Vector3d(std::cos(a), std::sin(a), rise).normalized();
    const double length = (height_m - pot) * random_.uniform(0.5, 0.95);
    const Eigen::Vector3d root = pose * Eigen::Vector3d(0.3 * r * std::cos(a), 0.3 * r * std::sin(a), pot * 0.9);
    const Skin skin{leaf_[random_.below(2)], {0, 0}, {0, 0}, false};
    const double bend = random_.uniform(0.3, 1.6), width = length * random_.uniform(0.16, 0.3);
    builder_.leaf(root, direction, length, width, bend, skin);
  }
}

void Furnisher::floor_lamp(const SE3& pose) {
  builder_.begin_mesh();
  builder_.lathe(pose, {{0.15, 0}, {0.15, 0.02}, {0.012, 0.03}, {0.012, 1.45}}, 16, plain(black_));
  builder_.lathe(pose * on_plan(0, 0, 1.35), {{0.2, 0}, {0.12, 0.28}}, 20, plain(white_));
}

void Furnisher::carton(const SE3& pose, const Eigen::Vector3d& size_m) {
  const Skin skin{carton_[random_.below(3)], {0, 0}, {0, 0}, false};
  builder_.box(pose * on_plan(0, 0, 0, random_.uniform(-4, 4)), size_m, skin);
}

void Furnisher::mug(const SE3& pose) {
  const double r = random_.uniform(0.036, 0.045), h = random_.uniform(0.085, 0.11);
  builder_.lathe(pose, {{r, 0}, {r, h}, {r * 0.88, h}, {r * 0.86, h * 0.25}, {0.001, h * 0.2}}, 16,
                 Skin{label_[random_.below(4)], {0, 0}, {0, 0}, false});
  std::vector<Eigen::Vector3d> handle;
  for (int i = 0; i <= 6; ++i) {
    const double a = -M_PI / 2 + M_PI * i / 6;
    handle.push_back(pose * Eigen::Vector3d(r * 0.95 + 0.028 * std::cos(a), 0, h * 0.5 + 0.03 * std::sin(a)));
  }
  builder_.tube(handle, std::vector<double>(7, 0.006), 6, plain(white_));
}

void Furnisher::bin(const SE3& pose) {
  builder_.begin_mesh();
  builder_.lathe(pose, {{0.001, 0.002}, {0.11, 0.002}, {0.14, 0.30}, {0.132, 0.30}, {0.10, 0.05}, {0.001, 0.05}}, 18,
                 plain(grey_));
}

void Furnisher::curtain(const SE3& pose, double width_m, double height_m) {
  builder_.begin_mesh();
  constexpr int kFolds = 10;
  const Skin cloth{fabric_[2], {0.35, 0.35}, {0, 0}, false};
  Eigen::Vector3d last;
  for (int i = 0; i <= kFolds; ++i) {
    const double depth = (i % 2 ? -0.05 : -0.015) + random_.uniform(-0.01, 0.01);
    const Eigen::Vector3d here = pose * Eigen::Vector3d(-width_m / 2 + width_m * i / kFolds, depth, 0);
    if (i > 0) builder_.quad(last, here - last, {0, 0, height_m}, cloth, 0.3);
    last = here;
  }
}

void Furnisher::wall_plate(const SE3& pose) {
  builder_.begin_mesh();
  builder_.box(pose * on_plan(0, -0.005), {0.082, 0.009, 0.082}, plain(white_), plain(white_), plain(white_), false);
  builder_.box(pose * on_plan(0, -0.012, 0.016), {0.05, 0.006, 0.05}, plain(grey_), plain(white_), plain(grey_), false);
}

void Furnisher::bottle(const SE3& pose) {
  const double r = random_.uniform(0.03, 0.042), h = random_.uniform(0.2, 0.28);
  builder_.lathe(pose, {{r, 0}, {r, h * 0.62}, {r * 0.4, h * 0.82}, {r * 0.36, h}, {0.001, h}}, 16,
                 Skin{label_[random_.below(4)], {0, 0}, {0, 0}, false});
}

void Furnisher::book_stack(const SE3& pose, int books) {
  double z = 0;
  for (int i = 0; i < books; ++i) {
    const double thick = random_.uniform(0.015, 0.045), wide = random_.uniform(0.15, 0.24),
                 deep = wide * random_.uniform(0.65, 0.75);
    const int number = random_.below(kSpinesPerImage);
    const std::uint16_t image = spines_[random_.below(3)];
    Skin spine =
        part_of(image, static_cast<double>(number) / kSpinesPerImage, 0, 1.0 / kSpinesPerImage, 1, thick, wide);
    spine.turned = true;
    const Skin cover = part_of(image, static_cast<double>(random_.below(kSpinesPerImage - 5)) / kSpinesPerImage, 0.1,
                               4.0 / kSpinesPerImage, 0.85, wide, deep);
    builder_.box(pose * on_plan(0, 0, z, random_.uniform(-12, 12)), {wide, deep, thick}, plain(paper_edge_), spine,
                 cover);
    z += thick + 0.0005;
  }
}

void Furnisher::pages(const SE3& pose, int sheets) {
  for (int i = 0; i < sheets; ++i) {
    const Skin printed{page_[random_.below(3)], {0, 0}, {0, 0}, false};
    const double turn_deg = random_.uniform(-40, 40), y = random_.uniform(-0.05, 0.05),
                 x = random_.uniform(-0.06, 0.06);
    builder_.box(pose * on_plan(x, y, 0.0022 * i, turn_deg), {0.21, 0.297, 0.002}, plain(white_), plain(white_),
                 printed);
  }
}

void Furnisher::clutter(const SE3& pose, double width_m, double depth_m, int things) {
  builder_.begin_mesh();
  const int columns = std::max(1, static_cast<int>(std::ceil(std::sqrt(things * width_m / depth_m))));
  const int rows = (things + columns - 1) / columns;
  for (int i = 0; i < things; ++i) {  // one thing per cell: nothing overlaps
    const double cell_x = width_m / columns, cell_y = depth_m / rows;
    const double x = -width_m / 2 + (i % columns + random_.uniform(0.38, 0.62)) * cell_x;
    const double y = -depth_m / 2 + (i / columns + random_.uniform(0.38, 0.62)) * cell_y;
    const SE3 here = pose * on_plan(x, y, 0, random_.uniform(-180, 180));
    switch (random_.below(6)) {
      case 0:
        mug(here);
        break;
      case 1:
        bottle(here);
        break;
      case 2:
        book_stack(here, 1 + random_.below(4));
        break;
      case 3:
        pages(here, 1 + random_.below(3));
        break;
      case 4:
        carton(here, {random_.uniform(0.08, 0.18), random_.uniform(0.06, 0.14), random_.uniform(0.05, 0.16)});
        break;
      default:
        pages(here, 2);
        mug(here * on_plan(0.03, 0.02, 0.0045));
        break;
    }
  }
}

void Furnisher::poster(const SE3& pose, double width_m, double height_m) {
  builder_.begin_mesh();
  const int width_px = std::clamp(static_cast<int>(width_m * 512), 128, 512);
  const std::uint16_t image =
      builder_.add_texture([size = cv::Size(width_px, static_cast<int>(width_px * height_m / width_m)),
                            s = random_.bits()] { return paint_poster(size, s); },
                           false);
  builder_.box(pose * on_plan(0, -0.006), {width_m, 0.01, height_m}, plain(black_), Skin{image, {0, 0}, {0, 0}, false},
               plain(black_), false);
}

void Furnisher::whiteboard(const SE3& pose, double width_m, double height_m) {
  builder_.begin_mesh();
  const std::uint16_t image = builder_.add_texture(
      [s = random_.bits()] {
        return paint_whiteboard({1024, 512}, s);
      },
      false);
  builder_.box(pose * on_plan(0, -0.01), {width_m, 0.018, height_m}, plain(metal_), Skin{image, {0, 0}, {0, 0}, false},
               plain(metal_));
  builder_.box(pose * on_plan(0, -0.045, -0.02), {width_m * 0.8, 0.06, 0.015}, plain(metal_));
}

}  // namespace semvslam::render
