#pragma once

#include <type_traits>

namespace semvslam {

/// Pixels of a row that are worked on at once: one or two vector registers of bytes.
constexpr int kBlock = 64;

/// Covers 0..n-1 with blocks: f(first, size), where size is a constant kBlock if n allows it. The last block is moved
/// back to end at n, so that some pixels are computed twice instead of one by one: a row's scalar rest would cost more
/// than the row.
template <typename F>
inline void for_each_block(int n, F&& f) {
  int x = 0;
  for (; x + kBlock <= n; x += kBlock) f(x, std::integral_constant<int, kBlock>{});
  if (x == n) return;
  if (n >= kBlock) {
    f(n - kBlock, std::integral_constant<int, kBlock>{});
  } else {
    f(0, n);
  }
}

}  // namespace semvslam
