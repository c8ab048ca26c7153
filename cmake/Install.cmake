# `cmake --install` and the Debian package (`cmake --build --preset release --target package`).
include(GNUInstallDirs)

# Packages of their own: nothing else needs PCL and VTK, or libtorch.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME weft)
foreach(extra weft-pcl weft-train)
  if(TARGET ${extra})
    install(TARGETS ${extra} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${extra})
    list(APPEND WEFT_EXTRA_PACKAGES ${extra})
  endif()
endforeach()

# For developers: what measures and refits the decoder, where it was built.
if(TARGET refit_decode)
  install(TARGETS accuracy_decode accuracy_drive film_layers refit_decode
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT weft-tools)
  install(PROGRAMS tests/benchmark/refit_constants.py DESTINATION ${CMAKE_INSTALL_DATADIR}/weft/tools COMPONENT weft-tools)
  list(APPEND WEFT_EXTRA_PACKAGES weft-tools)
endif()

install(TARGETS weft weftd weft-recorder weft-video weft-worker RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DATADIR}/weft)
install(FILES README.md LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/weft)
install(DIRECTORY config DESTINATION ${CMAKE_INSTALL_DATADIR}/weft)
install(DIRECTORY deploy/examples DESTINATION ${CMAKE_INSTALL_DATADIR}/weft)
# Blender installs add-ons of more than one file from a ZIP archive of their folder.
set(add_on ${PROJECT_BINARY_DIR}/blender)
configure_file(clients/blender/weft_blender.py ${add_on}/weft_blender/__init__.py COPYONLY)
configure_file(clients/blender/weft_result.py ${add_on}/weft_blender/weft_result.py COPYONLY)
execute_process(COMMAND ${CMAKE_COMMAND} -E tar cf ${add_on}/weft_blender.zip --format=zip weft_blender
  WORKING_DIRECTORY ${add_on} COMMAND_ERROR_IS_FATAL ANY)
install(FILES clients/blender/weft_blender.py clients/blender/weft_result.py ${add_on}/weft_blender.zip
  DESTINATION ${CMAKE_INSTALL_DATADIR}/weft/blender)
install(PROGRAMS deploy/tour.sh DESTINATION ${CMAKE_INSTALL_DATADIR}/weft)
install(FILES deploy/copyright SECURITY.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/weft)

# What the programs run with on the machine where they were built.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
install(CODE "
  set(bill \"${PROJECT_BINARY_DIR}/weft.cdx.json\")
  execute_process(COMMAND \"${Python3_EXECUTABLE}\" \"${PROJECT_SOURCE_DIR}/deploy/sbom.py\" --version ${PROJECT_VERSION}
      --out \"\${bill}\" --npm \"${PROJECT_SOURCE_DIR}/console/package-lock.json\" $<TARGET_FILE:weft> $<TARGET_FILE:weftd>
      $<TARGET_FILE:weft-recorder> $<TARGET_FILE:weft-video> $<TARGET_FILE:weft-worker>
    COMMAND_ERROR_IS_FATAL ANY)
  file(INSTALL \"\${bill}\" DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/doc/weft\")")

# systemd looks there whatever the prefix's `lib` is called.
install(FILES deploy/systemd/weftd.service DESTINATION lib/systemd/system)
install(FILES deploy/systemd/weft.sysusers DESTINATION lib/sysusers.d RENAME weft.conf)
install(FILES deploy/systemd/weft.tmpfiles DESTINATION lib/tmpfiles.d RENAME weft.conf)

# What shells complete is what the program that was built understands.
foreach(shell bash zsh)
  set(script ${CMAKE_BINARY_DIR}/completion/weft.${shell})
  add_custom_command(OUTPUT ${script}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/completion
    COMMAND weft completion ${shell} > ${script}
    DEPENDS weft VERBATIM)
  list(APPEND completion_scripts ${script})
endforeach()
add_custom_target(completion ALL DEPENDS ${completion_scripts})
install(FILES ${CMAKE_BINARY_DIR}/completion/weft.bash
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME weft)
# Debian's zsh looks for packages' completion elsewhere than for what /usr/local has.
install(CODE "
  set(folder zsh/site-functions)
  if(CMAKE_INSTALL_PREFIX MATCHES \"/usr/?$\")
    set(folder zsh/vendor-completions)
  endif()
  file(INSTALL \"${CMAKE_BINARY_DIR}/completion/weft.zsh\" RENAME _weft
    DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/\${folder}\")")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME weft)
set(CPACK_PACKAGE_CONTACT "The Weft maintainers <maintainers@weft.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "multi-view capture of cloth with a printed board")
set(CPACK_PACKAGE_DESCRIPTION
  "Weft films a garment that was sewn from fabric with a colour-coded print and\n\
registers it: one mesh per frame, the same vertices on the same threads of the\n\
cloth. It records GigE Vision and V4L2 cameras, calibrates them, builds the\n\
garment's template and registers takes, on one machine or through a daemon.\n\
.\n\
`/usr/share/weft/tour.sh` shows all of it without cameras, in five minutes.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/deploy/systemd/postinst)
set(CPACK_DEBIAN_WEFT_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/deploy/systemd/postinst)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS fonts-dejavu-core)  # labels of prints
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS ffmpeg)          # archives and videos
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "bash-completion, blender, python3-numpy, weft-pcl, weft-train")
set(CPACK_DEBIAN_WEFT-PCL_DESCRIPTION
  "This package has weft-pcl, with which weft reads and writes PCD, the format of\n\
the Point Cloud Library.")
set(CPACK_DEBIAN_WEFT-TRAIN_DESCRIPTION
  "This package has weft-train, with which weft trains the nets of avatars.")
set(CPACK_DEBIAN_WEFT-TOOLS_DESCRIPTION
  "This package has programs for developers: accuracy_decode and accuracy_drive\n\
measure decoding and driving against the truth of simulated takes, refit_decode\n\
and /usr/share/weft/tools/refit_constants.py fit the decoder's constants anew.")
if(WEFT_EXTRA_PACKAGES)
  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_DEBIAN_WEFT_PACKAGE_NAME weft)
  set(CPACK_DEBIAN_WEFT_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_WEFT_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION}")
endif()
foreach(extra IN LISTS WEFT_EXTRA_PACKAGES)
  string(TOUPPER ${extra} name)
  set(CPACK_DEBIAN_${name}_PACKAGE_NAME ${extra})
  set(CPACK_DEBIAN_${name}_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_${name}_PACKAGE_DEPENDS "weft (= ${PROJECT_VERSION})")
  set(CPACK_DEBIAN_${name}_PACKAGE_RECOMMENDS " ")  # not those of weft
  set(CPACK_DEBIAN_${name}_PACKAGE_SUGGESTS " ")
endforeach()
# Folders that come before this file have no default component: what they install would be a package of its own.
get_cmake_property(components COMPONENTS)
if("Unspecified" IN_LIST components)
  message(FATAL_ERROR "an install() in another folder lacks its COMPONENT")
endif()
include(CPack)
