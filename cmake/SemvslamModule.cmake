# One folder is one library is one concept. Tests (x_test.cc) and benchmarks (x_bench.cc) stand beside the source.
include(GoogleTest)

add_library(semvslam_build_flags INTERFACE)
target_compile_features(semvslam_build_flags INTERFACE cxx_std_20)
target_compile_options(semvslam_build_flags INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor)
if(SEMVSLAM_NATIVE)
  target_compile_options(semvslam_build_flags INTERFACE -march=native)
endif()
# The compiler may not fuse or reorder floating point by context: results must not depend on inlining decisions.
target_compile_options(semvslam_build_flags INTERFACE -ffp-contract=off)
if(SEMVSLAM_SANITIZE)
  # What the undefined-behaviour sanitizer finds ends the program; by itself it would only print.
  target_compile_options(semvslam_build_flags INTERFACE -fsanitize=${SEMVSLAM_SANITIZE} -fno-sanitize-recover=all
                         -fno-omit-frame-pointer)
  target_link_options(semvslam_build_flags INTERFACE -fsanitize=${SEMVSLAM_SANITIZE})
endif()

# semvslam_embed(VARIABLE STRUCT FOLDER EXTENSION NAME...): C++ initialisers STRUCT{"NAME", R"file(text of FOLDER/NAME.EXTENSION)file"}.
# Files that are part of the program: no path to get wrong, none to forget when installing.
function(semvslam_embed variable struct folder extension)
  set(all "")
  foreach(name ${ARGN})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${folder}/${name}.${extension})
    file(READ ${folder}/${name}.${extension} text)
    string(APPEND all "    ${struct}{\"${name}\", R\"file(${text})file\"},\n")
  endforeach()
  set(${variable} "${all}" PARENT_SCOPE)
endfunction()

# semvslam_module(NAME SOURCES a.cc... LINKS semvslam::base... [PRIVATE_LINKS ...] [TESTS a_test.cc...] [BENCHES a_bench.cc...])
function(semvslam_module name)
  cmake_parse_arguments(M "" "" "SOURCES;LINKS;PRIVATE_LINKS;TESTS;BENCHES" ${ARGN})
  add_library(semvslam_${name} STATIC ${M_SOURCES})
  add_library(semvslam::${name} ALIAS semvslam_${name})
  set_target_properties(semvslam_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(semvslam_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  # One alignment for our objects, for Ceres as packaged and for foreign consumers, whatever -march each was built with.
  target_compile_definitions(semvslam_${name} PUBLIC EIGEN_MAX_ALIGN_BYTES=16)
  target_compile_features(semvslam_${name} PUBLIC cxx_std_20)  # for users of the installed package too
  target_link_libraries(semvslam_${name} PUBLIC ${M_LINKS} PRIVATE ${M_PRIVATE_LINKS} $<BUILD_INTERFACE:semvslam_build_flags>)
  set_property(GLOBAL APPEND PROPERTY SEMVSLAM_MODULES semvslam_${name})
  if(SEMVSLAM_TESTS AND M_TESTS)
    find_package(GTest REQUIRED)
    add_executable(${name}_test ${M_TESTS})
    target_link_libraries(${name}_test PRIVATE semvslam_${name} semvslam_build_flags GTest::gmock GTest::gtest_main ${M_PRIVATE_LINKS})
    target_compile_definitions(${name}_test PRIVATE SEMVSLAM_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    if(SEMVSLAM_SANITIZE)
      # All in one process: under a sanitizer starting one takes longer than most tests do.
      add_test(NAME ${name}.all COMMAND ${name}_test --gtest_brief=1)
      set_tests_properties(${name}.all PROPERTIES TIMEOUT 1500)
    else()
      gtest_discover_tests(${name}_test TEST_PREFIX ${name}. DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 300)
    endif()
  endif()
  if(SEMVSLAM_BENCH AND M_BENCHES)
    find_package(benchmark REQUIRED)
    add_executable(${name}_bench ${M_BENCHES})
    target_link_libraries(${name}_bench PRIVATE semvslam_${name} semvslam_build_flags benchmark::benchmark_main ${M_PRIVATE_LINKS})
  endif()
endfunction()
