#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "semvslam/render/random.h"

namespace semvslam::render {

// Procedural images, CV_8UC3 BGR. "Tileable" ones repeat without a seam. All are functions of their arguments only.

/// As OpenCV's drawing functions take colours.
inline cv::Scalar scalar(const cv::Vec3f& c) { return {c[0], c[1], c[2]}; }

// --- surfaces of the room (paint_surfaces.cc) ---

/// Wooden boards along x: tone per board, grain, pores, gaps. @param boards number across y; 1 = one piece without
/// gaps.
cv::Mat paint_wood(cv::Size size, const cv::Vec3f& tone, int boards, std::uint32_t seed);
/// Painted wall with trowel marks, stains and specks.
cv::Mat paint_plaster(cv::Size size, const cv::Vec3f& tone, float roughness, std::uint32_t seed);
/// Brick wall in running bond. @param courses even number of rows of bricks; tileable.
cv::Mat paint_bricks(cv::Size size, int courses, std::uint32_t seed);
/// Square tiles, each its own marbling and tone.
cv::Mat paint_tiles(cv::Size size, int across, const cv::Vec3f& tone, std::uint32_t seed);
/// Short-pile carpet with coloured flecks, tileable.
cv::Mat paint_carpet(cv::Size size, const cv::Vec3f& tone, std::uint32_t seed);
/// Woven rug with borders and medallions.
cv::Mat paint_rug(cv::Size size, std::uint64_t seed);
/// Wallpaper: stripes and scattered ornaments of varying size.
cv::Mat paint_wallpaper(cv::Size size, std::uint64_t seed);
/// Plain material with a little unevenness and wear, tileable.
cv::Mat paint_material(cv::Size size, const cv::Vec3f& tone, float unevenness, std::uint32_t seed);
/// Woven cloth of two thread colours, tileable.
cv::Mat paint_fabric(cv::Size size, const cv::Vec3f& tone, const cv::Vec3f& second, std::uint32_t seed);

// --- things (paint_objects.cc) ---

/// A picture: landscape, abstract shapes, or a lettered poster, by seed.
cv::Mat paint_poster(cv::Size size, std::uint64_t seed);
/// `count` book spines side by side, each count-th of the width.
cv::Mat paint_spines(cv::Size size, int count, std::uint64_t seed);
/// A computer screen with windows of text, code and plots.
cv::Mat paint_screen(cv::Size size, std::uint64_t seed);
/// A printed page with text blocks, a figure, and hand-written marks.
cv::Mat paint_page(cv::Size size, std::uint64_t seed);
/// A whiteboard with formulas, boxes, arrows and half-wiped remains.
cv::Mat paint_whiteboard(cv::Size size, std::uint64_t seed);
/// What is seen through a window: sky, trees, houses.
cv::Mat paint_outdoors(cv::Size size, std::uint64_t seed);
/// Cardboard with print, tape and dents.
cv::Mat paint_cardboard(cv::Size size, std::uint64_t seed);
/// A leaf with veins.
cv::Mat paint_leaf(cv::Size size, std::uint64_t seed);
/// A keyboard seen from above.
cv::Mat paint_keyboard(cv::Size size, std::uint64_t seed);
/// A printed label for cans, cups and boxes; wraps around in x.
cv::Mat paint_label(cv::Size size, std::uint64_t seed);

/// A saturated colour of a hue in [0, 1), BGR 0..255.
cv::Vec3f hue_colour(double hue, double saturation, double value);
/// A pixel of an image of that size. Its two numbers are drawn one by one, not in the arguments of one call: their
/// order would differ from compiler to compiler.
cv::Point any_place(RandomStream& random, int width, int height);

}  // namespace semvslam::render
