# Finds OpenVINO, which runs the segmentation network fast. It comes as a Python package that carries headers, libraries and
# CMake files; ./semvslam puts it into build/openvino. Elsewhere: -DOpenVINO_DIR=..., or a python3 that can import it.
# Without it the network runs in OpenCV's DNN module.
if(NOT OpenVINO_DIR)
  find_package(Python3 QUIET COMPONENTS Interpreter)
  foreach(python ${PROJECT_SOURCE_DIR}/build/openvino/bin/python ${Python3_EXECUTABLE})
    if(EXISTS ${python} AND NOT OpenVINO_DIR)
      execute_process(COMMAND ${python} -c "import openvino.utils as u; print(u.get_cmake_path())"
                      OUTPUT_VARIABLE hint OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
      if(hint)
        find_package(OpenVINO QUIET COMPONENTS Runtime PATHS ${hint} NO_DEFAULT_PATH)
      endif()
    endif()
  endforeach()
endif()
find_package(OpenVINO QUIET COMPONENTS Runtime)
if(OpenVINO_FOUND)
  message(STATUS "Segmentation network: OpenVINO ${OpenVINO_VERSION}")
else()
  message(STATUS "Segmentation network: OpenCV DNN, which is slower (no OpenVINO: pip install openvino, then configure again)")
endif()
if(NOT OpenVINO_FOUND)
  return()
endif()

# OpenVINO's own target would put its folder among CMake's run-time paths, and CMake would warn, rightly in general, that a
# libtbb.so.12 lies there as well as in the system. Either serves both OpenCV and OpenVINO. So only the library's
# name is linked, and the path is CMake's to keep for what is built and to drop from what is installed.
get_target_property(library openvino::runtime IMPORTED_LOCATION_RELEASE)
get_filename_component(SEMVSLAM_OPENVINO_FOLDER ${library} DIRECTORY)
get_filename_component(SEMVSLAM_OPENVINO_LIBRARY ${library} NAME)
set(SEMVSLAM_OPENVINO_INSTALLED ${CMAKE_INSTALL_LIBDIR}/semvslam)
add_library(semvslam_openvino INTERFACE)
target_include_directories(semvslam_openvino SYSTEM INTERFACE
  $<TARGET_PROPERTY:openvino::runtime,INTERFACE_INCLUDE_DIRECTORIES>)
target_link_libraries(semvslam_openvino INTERFACE -l:${SEMVSLAM_OPENVINO_LIBRARY})
target_link_options(semvslam_openvino INTERFACE -L${SEMVSLAM_OPENVINO_FOLDER})
list(APPEND CMAKE_BUILD_RPATH ${SEMVSLAM_OPENVINO_FOLDER})

# The installed program brings the part of OpenVINO along that it uses: the readers of both forms of models/ (ONNX, and
# OpenVINO's own for the eight-bit trunk), the processor's plug-in and what they load.
set(SEMVSLAM_INSTALL_RPATH $ORIGIN/../${SEMVSLAM_OPENVINO_INSTALLED})
file(GLOB libraries ${library} ${SEMVSLAM_OPENVINO_FOLDER}/libopenvino_intel_cpu_plugin.so
     ${SEMVSLAM_OPENVINO_FOLDER}/libopenvino_arm_cpu_plugin.so ${SEMVSLAM_OPENVINO_FOLDER}/libopenvino_onnx_frontend.so.*
     ${SEMVSLAM_OPENVINO_FOLDER}/libopenvino_ir_frontend.so.* ${SEMVSLAM_OPENVINO_FOLDER}/libtbb*.so.*
     ${SEMVSLAM_OPENVINO_FOLDER}/libhwloc.so.*)
install(FILES ${libraries} DESTINATION ${SEMVSLAM_OPENVINO_INSTALLED})
