# The Debian package: cpack --config build/release/CPackConfig.cmake
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME perimap)
# A place-holder, here and in changelog.in: whoever gives the package to others fills in an address that is read
# (SECURITY.md).
set(CPACK_PACKAGE_CONTACT "perimap maintainers <maintainers@perimap.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX ${CMAKE_INSTALL_PREFIX})
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGE_DESCRIPTION "perimapd reads a camera, a tracker that knows the camera's pose, and an ECG.
It estimates the periodic motion of each visual feature and publishes the
predicted surface over DDS at a fixed latency. perimap is its companion on the
command line.
.
This is research software. It is not a medical device and must not be used on
patients.")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "systemd, fonts-dejavu-core")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# dpkg keeps what an administrator has changed in these.
set(conffiles ${CMAKE_CURRENT_BINARY_DIR}/debian/conffiles)
file(WRITE ${conffiles} "${configuration_dir}/cyclonedds-loopback.xml
${configuration_dir}/cyclonedds-network.xml
${configuration_dir}/perimapd.toml.example
")
if(profile_dir)
  file(APPEND ${conffiles} "${profile_dir}/perimapd\n")
endif()
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${conffiles}
  ${CMAKE_CURRENT_SOURCE_DIR}/debian/postinst ${CMAKE_CURRENT_SOURCE_DIR}/debian/prerm
  ${CMAKE_CURRENT_SOURCE_DIR}/debian/postrm)

install(FILES debian/lintian-overrides DESTINATION share/lintian/overrides RENAME perimap)
install(FILES debian/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR})
string(TIMESTAMP released "%a, %d %b %Y %H:%M:%S +0000" UTC)
configure_file(debian/changelog.in debian/changelog @ONLY)
execute_process(COMMAND ${GZIP} -9nkf debian/changelog WORKING_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}
  COMMAND_ERROR_IS_FATAL ANY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/debian/changelog.gz DESTINATION ${CMAKE_INSTALL_DOCDIR})
include(CPack)
