#pragma once

#include <cstddef>
#include <cstdint>

namespace semvslam {

/// Undoes one row's PNG filter in place (PNG specification, section 9: None, Sub, Up, Average, Paeth).
/// @param filter the row's filter type, 0..4. @param row its `size` filtered bytes. @param above the unfiltered row
/// above, or zeros. @param pixel_bytes 1, 2, 3 or 4.
/// @return false for a filter type that does not exist.
bool png_unfilter_row(int filter, std::uint8_t* row, const std::uint8_t* above, std::size_t size, int pixel_bytes);

}  // namespace semvslam
