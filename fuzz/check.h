#pragma once

#include <cstdio>
#include <cstdlib>

/// Ends the run as a finding when something that must hold for every input does not.
#define FUZZ_CHECK(condition)                                                             \
  do {                                                                                    \
    if (!(condition)) {                                                                   \
      std::fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                       \
    }                                                                                     \
  } while (false)

/// A message for the user is one line of printable text.
#define FUZZ_CHECK_MESSAGE(error)                                \
  do {                                                           \
    FUZZ_CHECK(!(error).message.empty());                        \
    FUZZ_CHECK((error).message.find('\n') == std::string::npos); \
  } while (false)
