#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "semvslam/render/scene_builder.h"

namespace semvslam::render {

/// A flat lamp or window: light leaves it on the side of its normal.
struct AreaLight {
  Eigen::Vector3d centre, half_u, half_v, normal;
  Eigen::Vector3d radiance;  // blue, green, red; linear
};

/// Where somebody can sit: under the middle of the seat, on the floor; faces direction (cos, sin) of the heading.
struct Seat {
  Eigen::Vector2d position;
  double heading_rad = 0;
  double height_m = 0.45;
};

// The plan, in metres. Room A is [-3.6, 3.6] x [-3.2, 3.2]; room B is [3.72, 7.3] x [-3.2, 3.2]; two doorways join
// them, so that there is a loop. A group of desks stands in the middle of A. Lanes are free of furniture at body width.
constexpr double kRoomHeight_m = 2.7;
constexpr double kRoomAWest_m = -3.6, kRoomAEast_m = 3.6, kRoomBWest_m = 3.72, kRoomBEast_m = 7.3;
constexpr double kRoomsSouth_m = -3.2, kRoomsNorth_m = 3.2;
constexpr double kSouthDoor_m = -2.15, kNorthDoor_m = 2.4, kDoorWidth_m = 1.0, kDoorHeight_m = 2.1;
constexpr double kDesksWest_m = -1.3, kDesksEast_m = 0.7, kDesksHalfDepth_m = 0.7, kDeskHeight_m = 0.73;
constexpr double kWalkWest_m = -2.25, kWalkEast_m = 1.35, kWalkSouth_m = -1.15, kWalkNorth_m = 1.65;

struct Room {
  std::vector<AreaLight> lights;
  std::vector<Seat> seats;
};

/// Adds floors, walls, doors, windows, lamps and furniture. @param seed of textures and clutter; the plan is always the
/// same.
Room build_room(SceneBuilder& builder, std::uint64_t seed);

}  // namespace semvslam::render
