# The libraries for other programs: find_package(tandem), targets tandem::NAME (docs/cpp.md). With COMPONENTS services also those of a
# process of one's own on the topics (docs/own-hardware.md), which need Fast DDS. Recordings are not included.
include(CMakePackageConfigHelpers)
include(CheckCXXSymbolExists)
set(names base safety kinematics control planning hal_can hal_canopen hal_drives hal sim sim_drives config robots robot_plant experiments
    operation)
set(services idl dds security runtime_base runtime)
target_compile_features(tandem_base INTERFACE cxx_std_20)
target_include_directories(tandem_base INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/tandem>)
# With AVX, Eigen aligns and frees memory differently: users of the libraries must be compiled with the same options.
check_cxx_symbol_exists(__AVX__ cstddef TANDEM_WITH_AVX)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND NOT TANDEM_WITH_AVX)
  target_compile_options(tandem_base INTERFACE $<INSTALL_INTERFACE:-mno-avx>)
endif()
foreach(name IN LISTS names)
  set_target_properties(tandem_${name} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS tandem_${name} EXPORT tandem-targets DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endforeach()
foreach(name IN LISTS services)
  set_target_properties(tandem_${name} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS tandem_${name} EXPORT tandem-services DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endforeach()

foreach(room safety kinematics control planning hal sim config robots experiments operation services/dds services/runtime)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR} ${room}/*.h ${room}/*.inc)
  list(FILTER headers EXCLUDE REGEX "/detail/|_detail[.]h$|/(endpoint_list|identities|start_transport)[.]h$")  # internal: no public header includes them
  foreach(header IN LISTS headers)
    cmake_path(GET header PARENT_PATH folder)
    install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tandem/${folder} COMPONENT dev)
  endforeach()
endforeach()

install(FILES ${CMAKE_BINARY_DIR}/idl/plain/idl/enumerations.h ${CMAKE_BINARY_DIR}/idl/plain/idl/messages.h
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tandem/idl COMPONENT dev)

set(folder ${CMAKE_INSTALL_LIBDIR}/cmake/tandem)
set(data ${CMAKE_INSTALL_DATADIR}/tandem)
configure_package_config_file(deploy/packaging/tandem-config.cmake.in ${CMAKE_BINARY_DIR}/tandem-config.cmake
                              INSTALL_DESTINATION ${folder} PATH_VARS data)
# Below 1.0 a minor version may change the headers.
write_basic_package_version_file(${CMAKE_BINARY_DIR}/tandem-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/tandem-config.cmake ${CMAKE_BINARY_DIR}/tandem-config-version.cmake DESTINATION ${folder}
        COMPONENT dev)
install(EXPORT tandem-targets NAMESPACE tandem:: DESTINATION ${folder} COMPONENT dev)
install(EXPORT tandem-services NAMESPACE tandem:: DESTINATION ${folder} COMPONENT dev)
