# Debian packages: `cpack` in a build tree, or deploy/package.sh. Files installed without a component belong to tandem-robot; a separate
# package needs `install(... COMPONENT NAME)` and a few lines here.
install(DIRECTORY deploy/systemd/ DESTINATION lib/systemd/system)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
    WORLD_EXECUTE)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_OUTPUT_FILE_PREFIX ${CMAKE_BINARY_DIR}/packages)
set(CPACK_PACKAGE_CHECKSUM SHA256)
set(CPACK_PACKAGE_VENDOR Tandem)
set(CPACK_PACKAGE_CONTACT "Tandem developers <tandem@localhost.localdomain>")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_COMPONENTS_ALL robot python dev)

set(CPACK_DEBIAN_ROBOT_PACKAGE_NAME tandem-robot)
set(CPACK_COMPONENT_ROBOT_DESCRIPTION
    "control of cooperating continuum robots over DDS
Two concentric tube robots that work through one port: control, planning, HAL
on CANopen, a simulated robot, the command line, presets and systemd units.
Research software, not for clinical use.")
set(CPACK_DEBIAN_ROBOT_PACKAGE_SECTION science)
set(CPACK_DEBIAN_ROBOT_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_ROBOT_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_ROBOT_PACKAGE_DEPENDS adduser)
set(CPACK_DEBIAN_ROBOT_PACKAGE_RECOMMENDS "systemd | systemd-sysv, can-utils, python3-numpy, python3-matplotlib")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-tandem)
set(CPACK_COMPONENT_PYTHON_DESCRIPTION
    "models and control of cooperating continuum robots for Python
The module tandem: kinematics, redundancy resolution, simulation, planning,
recordings and running robots of Tandem, on numpy arrays.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3, python3-numpy, tandem-robot")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/deploy/packaging/python/postinst
    ${PROJECT_SOURCE_DIR}/deploy/packaging/python/prerm)

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libtandem-dev)
set(CPACK_COMPONENT_DEV_DESCRIPTION
    "models and control of cooperating continuum robots, for C++ programs
Headers, static libraries and the CMake package of Tandem: kinematics, redundancy
resolution, planning, safety, hardware, simulation, robot files, and what a
process of one's own on the topics is made of.")
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4), coinor-libipopt-dev, libyaml-cpp-dev, tandem-robot")
set(CPACK_DEBIAN_DEV_PACKAGE_RECOMMENDS "cmake, g++, libfastrtps-dev, libfastcdr-dev, libspdlog-dev, libfmt-dev, libssl-dev")

set(scripts ${PROJECT_SOURCE_DIR}/deploy/packaging/robot)
set(CPACK_DEBIAN_ROBOT_PACKAGE_CONTROL_EXTRA ${scripts}/postinst ${scripts}/prerm ${scripts}/postrm ${scripts}/conffiles)
set(CPACK_TANDEM_CROSSCOMPILING ${CMAKE_CROSSCOMPILING})
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/deploy/packaging/staging.cmake)
include(CPack)
