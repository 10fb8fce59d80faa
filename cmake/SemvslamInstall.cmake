# Installs the libraries, their headers, the program and a package for find_package(semvslam).
include(CMakePackageConfigHelpers)
get_property(modules GLOBAL PROPERTY SEMVSLAM_MODULES)

list(REMOVE_ITEM modules semvslam_apps semvslam_web semvslam_download)  # the program's own parts are no library for others

# One target for users who do not want to think about modules.
add_library(semvslam_all INTERFACE)
add_library(semvslam::semvslam ALIAS semvslam_all)
set_target_properties(semvslam_all PROPERTIES EXPORT_NAME semvslam)
target_link_libraries(semvslam_all INTERFACE ${modules})

install(TARGETS ${modules} semvslam_all EXPORT semvslamTargets)
if(TARGET semvslam_program)
  install(TARGETS semvslam_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
install(DIRECTORY src/semvslam DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        FILES_MATCHING PATTERN "*.h" PATTERN "*_test*" EXCLUDE PATTERN "apps" EXCLUDE PATTERN "web" EXCLUDE PATTERN "download" EXCLUDE PATTERN "python" EXCLUDE)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
set(SEMVSLAM_MODELS ${CMAKE_INSTALL_DATADIR}/semvslam/models)
install(DIRECTORY models/ DESTINATION ${SEMVSLAM_MODELS} PATTERN "golden" EXCLUDE PATTERN "training_log*" EXCLUDE)

if(NOT OpenVINO_FOUND)
  set(SEMVSLAM_OPENVINO_INSTALLED ${CMAKE_INSTALL_LIBDIR})  # unused there
endif()
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/semvslam)
install(EXPORT semvslamTargets NAMESPACE semvslam:: DESTINATION ${package_folder})
configure_package_config_file(cmake/semvslamConfig.cmake.in ${CMAKE_BINARY_DIR}/semvslamConfig.cmake
                              INSTALL_DESTINATION ${package_folder} PATH_VARS SEMVSLAM_MODELS SEMVSLAM_OPENVINO_INSTALLED)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/semvslamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/semvslamConfig.cmake ${CMAKE_BINARY_DIR}/semvslamConfigVersion.cmake
        DESTINATION ${package_folder})
