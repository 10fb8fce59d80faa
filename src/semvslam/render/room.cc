#include "semvslam/render/room.h"

#include "semvslam/render/furniture.h"
#include "semvslam/render/paint.h"

namespace semvslam::render {
namespace {

struct Shell {
  SceneBuilder& builder;
  std::uint16_t plaster, bricks, wallpaper, parquet, carpet, ceiling, skirting, frame, outdoors, rug, lamp;
};

Shell paint_shell(SceneBuilder& builder, RandomStream& random) {
  Shell shell{builder, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  shell.plaster = builder.add_texture([s = random.bits32()] {
    return paint_plaster({2048, 1024}, {196, 208, 214}, 0.8f, s);
  });
  shell.bricks = builder.add_texture([s = random.bits32()] { return paint_bricks({1024, 1024}, 28, s); });
  shell.wallpaper = builder.add_texture([s = random.bits()] { return paint_wallpaper({2048, 1024}, s); });
  shell.parquet = builder.add_texture([s = random.bits32()] {
    return paint_wood({2048, 1024}, {86, 130, 180}, 26, s);
  });
  shell.carpet = builder.add_texture([soft = random.chance(0.5), s = random.bits32()] {
    return soft ? paint_carpet({1024, 1024}, {120, 96, 84}, s) : paint_tiles({1024, 1024}, 10, {176, 190, 200}, s);
  });
  shell.ceiling = builder.add_texture([s = random.bits32()] {
    return paint_tiles({1024, 1024}, 8, {222, 226, 228}, s);
  });
  shell.skirting = builder.add_texture([s = random.bits32()] { return paint_wood({512, 64}, {150, 170, 185}, 1, s); });
  shell.frame = builder.add_texture([s = random.bits32()] {
    return paint_material({256, 256}, {205, 212, 215}, 0.12f, s);
  });
  shell.outdoors = builder.add_texture([s = random.bits()] { return paint_outdoors({1024, 512}, s); }, false);
  shell.rug = builder.add_texture([s = random.bits()] { return paint_rug({1024, 768}, s); }, false);
  shell.lamp = builder.add_texture([] { return cv::Mat(8, 8, CV_8UC3, cv::Scalar(252, 254, 255)); });
  return shell;
}

/// A piece of wall between two points of the plan, seen from the right of the way from `a` to `b`.
void wall(Shell& s, Eigen::Vector2d a, Eigen::Vector2d b, double low, double high, std::uint16_t texture,
          const Eigen::Vector2d& image_m) {
  const double along = std::abs(a.x() - b.x()) > 0.01 ? a.x() : a.y();
  const Skin skin{texture, image_m, {std::abs(along) + 1.0, low}, false};
  s.builder.quad({a.x(), a.y(), low}, {b.x() - a.x(), b.y() - a.y(), 0}, {0, 0, high - low}, skin, 0.16);
  if (low > 0.01) return;
  const Eigen::Vector2d way = (b - a).normalized(), inwards(way.y(), -way.x());
  const double length = (b - a).norm(), turn_deg = std::atan2(way.y(), way.x()) * 180 / M_PI;
  const Eigen::Vector2d middle = (a + b) / 2 + inwards * 0.008;
  s.builder.box(on_plan(middle.x(), middle.y(), 0, turn_deg), {length, 0.016, 0.09},
                Skin{s.skirting, {1.0, 0.09}, {0, 0}, false});
}

void window(Shell& s, const SE3& pose, double width_m, double height_m, std::vector<AreaLight>& lights) {
  s.builder.begin_mesh();
  const Eigen::Matrix3d r = pose.rotation_matrix();
  const Skin frame{s.frame, {0.5, 0.5}, {0, 0}, false};
  s.builder.quad(pose * Eigen::Vector3d(-width_m / 2, -0.004, 0), r * Eigen::Vector3d(width_m, 0, 0),
                 r * Eigen::Vector3d(0, 0, height_m), Skin{s.outdoors, {0, 0}, {0, 0}, false}, 0.1, true);
  for (const double x : {-width_m / 2, 0.0, width_m / 2})
    s.builder.box(pose * on_plan(x, -0.025), {0.06, 0.04, height_m}, frame);
  for (const double z : {-0.03, height_m * 0.62, height_m - 0.03})
    s.builder.box(pose * on_plan(0, -0.027, z), {width_m, 0.045, 0.05}, frame);
  s.builder.box(pose * on_plan(0, -0.08, -0.06), {width_m + 0.2, 0.16, 0.03}, frame);
  for (int i = 0; i < 12; ++i) {  // radiator below
    s.builder.box(pose * on_plan(-width_m / 2 + (i + 0.5) * width_m / 12, -0.05, -0.72),
                  {width_m / 12 - 0.012, 0.07, 0.55}, frame);
  }
  lights.push_back({pose * Eigen::Vector3d(0, -0.03, height_m / 2),
                    r * Eigen::Vector3d(width_m / 2, 0, 0),
                    {0, 0, height_m / 2},
                    r * Eigen::Vector3d(0, -1, 0),
                    Eigen::Vector3d(3.4, 3.1, 2.8)});
}

void lamp(Shell& s, double x, double y, std::vector<AreaLight>& lights) {
  s.builder.begin_mesh();
  const Skin rim{s.frame, {0.5, 0.5}, {0, 0}, false};
  s.builder.box(on_plan(x, y, kRoomHeight_m - 0.05), {1.26, 0.36, 0.05}, rim);
  s.builder.quad({x - 0.6, y + 0.15, kRoomHeight_m - 0.052}, {1.2, 0, 0}, {0, -0.3, 0},
                 Skin{s.lamp, {0, 0}, {0, 0}, false}, 0.1, true);
  lights.push_back(
      {{x, y, kRoomHeight_m - 0.06}, {0.6, 0, 0}, {0, 0.15, 0}, {0, 0, -1}, Eigen::Vector3d(11.4, 12.7, 13.5)});
}

void floors_and_ceilings(Shell& s) {
  const double depth = kRoomsNorth_m - kRoomsSouth_m, width_a = kRoomAEast_m - kRoomAWest_m,
               width_b = kRoomBEast_m - kRoomBWest_m;
  s.builder.begin_mesh();
  // Two halves of the floor show the same image, one turned round.
  const Skin parquet{s.parquet, {7.2, 3.6}, {0, 0}, false};
  const double half = 3.6;
  s.builder.quad({kRoomAWest_m, kRoomsSouth_m, 0}, {width_a, 0, 0}, {0, half, 0}, parquet, 0.11);
  s.builder.quad({kRoomAEast_m, kRoomsNorth_m, 0}, {-width_a, 0, 0}, {0, half - depth, 0}, parquet, 0.11);
  s.builder.quad({kRoomBWest_m, kRoomsSouth_m, 0}, {width_b, 0, 0}, {0, depth, 0},
                 Skin{s.carpet, {3.3, 3.3}, {0.4, 0.1}, false}, 0.12);
  for (const double y : {kSouthDoor_m, kNorthDoor_m}) {  // thresholds
    s.builder.quad({kRoomAEast_m, y - kDoorWidth_m / 2, 0}, {kRoomBWest_m - kRoomAEast_m, 0, 0}, {0, kDoorWidth_m, 0},
                   Skin{s.skirting, {0.4, 0.2}, {0, 0}, false});
  }
  const Eigen::Vector2d image(4.8, 4.8);
  s.builder.quad({kRoomAWest_m, kRoomsNorth_m, kRoomHeight_m}, {width_a, 0, 0}, {0, -depth, 0},
                 Skin{s.ceiling, image, {0, 0}, false}, 0.35);
  s.builder.quad({kRoomBWest_m, kRoomsNorth_m, kRoomHeight_m}, {width_b, 0, 0}, {0, -depth, 0},
                 Skin{s.ceiling, image, {0.7, 0.2}, false}, 0.35);
  s.builder.begin_mesh();
  s.builder.box(on_plan(-0.4, 0.2, 0.001), {3.0, 2.5, 0.009}, Skin{s.rug, {0, 0}, {0, 0}, false});
}

void walls(Shell& s) {
  const double w = kRoomAWest_m, e = kRoomAEast_m, bw = kRoomBWest_m, be = kRoomBEast_m, n = kRoomsNorth_m,
               so = kRoomsSouth_m, h = kRoomHeight_m;
  const Eigen::Vector2d plaster(8.2, 4.1), bricks(2.1, 2.1), paper(6.6, 3.3);
  s.builder.begin_mesh();
  wall(s, {w, n}, {e, n}, 0, h, s.plaster, plaster);
  s.builder.begin_mesh();
  wall(s, {e, so}, {w, so}, 0, h, s.plaster, plaster);
  s.builder.begin_mesh();
  wall(s, {w, so}, {w, n}, 0, h, s.bricks, bricks);
  s.builder.begin_mesh();
  wall(s, {bw, n}, {be, n}, 0, h, s.wallpaper, paper);
  s.builder.begin_mesh();
  wall(s, {be, n}, {be, so}, 0, h, s.wallpaper, paper);
  s.builder.begin_mesh();
  wall(s, {be, so}, {bw, so}, 0, h, s.wallpaper, paper);
  // The wall between the rooms, with its doorways.
  s.builder.begin_mesh();
  const double d = kDoorWidth_m / 2;
  const double pieces[3][2] = {{so, kSouthDoor_m - d}, {kSouthDoor_m + d, kNorthDoor_m - d}, {kNorthDoor_m + d, n}};
  for (const auto& piece : pieces) {
    wall(s, {e, piece[1]}, {e, piece[0]}, 0, h, s.plaster, plaster);
    wall(s, {bw, piece[0]}, {bw, piece[1]}, 0, h, s.wallpaper, paper);
  }
  const Skin frame{s.skirting, {1.0, 0.12}, {0, 0}, true};
  for (const double y : {kSouthDoor_m, kNorthDoor_m}) {
    wall(s, {e, y + d}, {e, y - d}, kDoorHeight_m, h, s.plaster, plaster);
    wall(s, {bw, y - d}, {bw, y + d}, kDoorHeight_m, h, s.wallpaper, paper);
    s.builder.quad({e, y - d, 0}, {0, 0, kDoorHeight_m}, {bw - e, 0, 0}, frame);
    s.builder.quad({bw, y + d, 0}, {0, 0, kDoorHeight_m}, {e - bw, 0, 0}, frame);
    s.builder.quad({bw, y - d, kDoorHeight_m}, {e - bw, 0, 0}, {0, 2 * d, 0}, frame);
    for (const double x : {e - 0.008, bw + 0.008}) {
      s.builder.box(on_plan(x, y - d - 0.04), {0.02, 0.08, kDoorHeight_m + 0.08}, frame);
      s.builder.box(on_plan(x, y + d + 0.04), {0.02, 0.08, kDoorHeight_m + 0.08}, frame);
      s.builder.box(on_plan(x, y, kDoorHeight_m), {0.02, 2 * d, 0.08}, Skin{s.skirting, {1.0, 0.12}, {0, 0}, false});
    }
  }
}

void desks(Furnisher& f, RandomStream& random, std::vector<Seat>& seats) {
  const double x = (kDesksWest_m + kDesksEast_m) / 2, depth = kDesksHalfDepth_m, width = kDesksEast_m - kDesksWest_m,
               top = kDeskHeight_m;
  f.desk(on_plan(x, -depth / 2), width, depth, top);
  f.desk(on_plan(x, depth / 2, 0, 180), width, depth, top);
  f.monitor(on_plan(x - 0.45, -0.14, top, random.uniform(-8, 2)), 0.54);
  f.monitor(on_plan(x + 0.25, -0.12, top, random.uniform(2, 12)), 0.5);
  f.monitor(on_plan(x + 0.62, 0.2, top, 180 + random.uniform(-10, 10)), 0.5);
  f.keyboard(on_plan(x - 0.4, -0.48, top, random.uniform(-6, 6)));
  f.keyboard(on_plan(x + 0.5, 0.5, top, 180 + random.uniform(-6, 6)));
  f.clutter(on_plan(x + 0.62, -0.45, top), 0.6, 0.42, 6);
  f.clutter(on_plan(x - 0.5, 0.22, top), 0.8, 0.34, 7);
  f.clutter(on_plan(x - 0.86, -0.4, top), 0.26, 0.5, 3);
  f.plant(on_plan(x - 0.05, 0.02, top), 0.36);
  f.office_chair(on_plan(x - 0.35, -0.55, 0, 188));
  seats.push_back({{x - 0.42, 1.02}, -M_PI / 2, 0.467});
  seats.push_back({{kDesksWest_m - 0.36, 0.12}, 0.15, 0.467});
  seats.push_back({{x + 0.55, 1.05}, -M_PI / 2 + 0.2, 0.467});
  f.office_chair(on_plan(seats[0].position.x(), seats[0].position.y(), 0, 0));
  f.office_chair(on_plan(seats[1].position.x(), seats[1].position.y(), 0, 98));
  f.office_chair(on_plan(seats[2].position.x(), seats[2].position.y(), 0, 11));
}

void furnish_a(Furnisher& f) {
  const double n = kRoomsNorth_m, so = kRoomsSouth_m, w = kRoomAWest_m, e = kRoomAEast_m;
  f.bookshelf(on_plan(-2.75, n - 0.17), 1.5, 2.05, 0.32, 5);
  f.cabinet(on_plan(-1.0, n - 0.19), {1.7, 0.36, 0.82}, 4);
  f.clutter(on_plan(-1.0, n - 0.19, 0.82), 1.6, 0.3, 9);
  f.whiteboard(on_plan(-1.0, n, 1.12), 1.7, 1.05);
  f.plant(on_plan(3.3, so + 0.28), 1.25);
  f.poster(on_plan(2.85, n, 1.35), 0.6, 0.85);
  for (const double x : {0.2, 2.2}) f.curtain(on_plan(x, n - 0.06, 0.25), 0.34, 2.15);
  f.carton(on_plan(2.7, n - 0.22), {0.45, 0.34, 0.32});
  f.book_stack(on_plan(2.7, n - 0.22, 0.32), 4);
  f.bin(on_plan(0.02, n - 0.22));
  f.bin(on_plan(w + 0.2, 2.6));
  for (const double y : {-2.6, 0.75, 2.3}) f.wall_plate(on_plan(w, y, 0.3, 90));
  for (const double x : {-2.1, 0.15, 2.5}) f.wall_plate(on_plan(x, n, x > 2 ? 1.1 : 0.3));
  for (const double y : {-1.5, 1.75}) f.wall_plate(on_plan(e, y, 1.1, -90));
  f.poster(on_plan(w, 0.1, 1.1, 90), 0.8, 1.1);
  f.poster(on_plan(w, -1.2, 1.3, 90), 0.6, 0.45);
  f.poster(on_plan(w, 1.5, 1.2, 90), 1.0, 0.7);
  f.bookshelf(on_plan(-2.9, so + 0.18, 0, 180), 1.2, 1.9, 0.32, 5);
  f.poster(on_plan(-1.4, so, 1.15, 180), 0.7, 0.95);
  f.poster(on_plan(-0.4, so, 1.3, 180), 0.9, 0.65);
  f.poster(on_plan(0.6, so, 1.1, 180), 0.6, 0.9);
  f.cabinet(on_plan(2.1, so + 0.2, 0, 180), {1.5, 0.36, 1.0}, 3);
  f.clutter(on_plan(2.1, so + 0.2, 1.0), 1.4, 0.3, 8);
  f.poster(on_plan(2.1, so, 1.45, 180), 1.1, 0.75);
  f.bookshelf(on_plan(e - 0.17, 0.95, 0, -90), 1.2, 2.1, 0.3, 6);
  f.cabinet(on_plan(e - 0.2, -0.6, 0, -90), {1.5, 0.36, 0.9}, 3);
  f.clutter(on_plan(e - 0.2, -0.6, 0.9, 90), 1.4, 0.3, 8);
  f.poster(on_plan(e, -0.25, 1.25, -90), 0.7, 0.95);
  f.poster(on_plan(e, -1.1, 1.35, -90), 0.55, 0.75);
}

void furnish_b(Furnisher& f) {
  const double n = kRoomsNorth_m, so = kRoomsSouth_m, w = kRoomBWest_m, e = kRoomBEast_m;
  f.sofa(on_plan(e - 0.44, 0.1, 0, -90), 2.2);
  f.cabinet(on_plan(e - 1.35, 0.1, 0, -90), {1.1, 0.55, 0.4}, 2);
  f.clutter(on_plan(e - 1.35, 0.1, 0.4, 90), 1.0, 0.45, 5);
  f.poster(on_plan(e, -0.4, 1.3, -90), 0.8, 1.0);
  f.poster(on_plan(e, 0.7, 1.25, -90), 1.0, 0.75);
  f.floor_lamp(on_plan(e - 0.4, 1.75));
  f.plant(on_plan(e - 0.4, -1.6), 1.4);
  f.bookshelf(on_plan(5.9, n - 0.17, 0, 0), 1.9, 2.0, 0.3, 5);
  f.poster(on_plan(4.3, n, 1.2, 0), 0.65, 0.9);
  f.bookshelf(on_plan(5.2, so + 0.17, 0, 180), 1.5, 1.2, 0.3, 3);
  f.clutter(on_plan(5.2, so + 0.17, 1.2), 1.4, 0.25, 7);
  f.poster(on_plan(5.2, so, 1.6, 180), 1.2, 0.8);
  f.poster(on_plan(6.7, so, 1.2, 180), 0.7, 1.0);
  f.bookshelf(on_plan(w + 0.17, -0.6, 0, 90), 1.5, 1.95, 0.3, 5);
  f.poster(on_plan(w, 0.7, 1.2, 90), 0.9, 0.9);
  f.wall_plate(on_plan(w, -1.5, 1.1, 90));
  f.wall_plate(on_plan(4.75, n, 0.3));
  f.bin(on_plan(4.3, n - 0.25));
  f.carton(on_plan(6.9, -2.8, 0, 15), {0.5, 0.4, 0.4});
  f.carton(on_plan(6.9, -2.82, 0.4, -10), {0.4, 0.35, 0.3});
}

}  // namespace

Room build_room(SceneBuilder& builder, std::uint64_t seed) {
  RandomStream random(mix64(seed, 17));
  Room room;
  Shell shell = paint_shell(builder, random);
  floors_and_ceilings(shell);
  walls(shell);
  for (const double x : {-1.9, 1.3}) {
    for (const double y : {-1.4, 1.5}) lamp(shell, x, y, room.lights);
  }
  for (const double y : {-1.5, 1.5}) lamp(shell, 5.5, y, room.lights);
  window(shell, on_plan(1.2, kRoomsNorth_m, 0.95), 1.7, 1.35, room.lights);
  Furnisher furnisher(builder, seed);
  desks(furnisher, random, room.seats);
  furnish_a(furnisher);
  furnish_b(furnisher);
  room.seats.push_back({{kRoomBEast_m - 0.55, 0.1}, M_PI, 0.44});
  return room;
}

}  // namespace semvslam::render
