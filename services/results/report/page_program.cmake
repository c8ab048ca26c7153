# Pages' style sheet and program become constants in the build tree. The program's files are modules, so that tests and editors
# can read each of them by itself; in pages they are one script, in this order, without the lines that import. Names that a file
# does not export stay its own.
set(page_files
  numbers.js
  parts.js
  plot_axes.js
  plot.js
  pictures.js
  rig.js
  mesh_canvas.js
  sequence.js
  paper.js
  job_frames.js
  job_cameras.js
  job_stages.js
  job_parts.js
  job.js
  heat_map.js
  evaluation.js
  comparison.js
  rig_plan.js
  calibration.js
  template.js
  sync.js
  start.js)

set(page_program "")
foreach(page_file IN LISTS page_files)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/page/${page_file})
  file(READ page/${page_file} page_text)
  string(REGEX REPLACE "import {[^}]*} from \"[^\"]*\";\n" "" page_text "${page_text}")
  string(REGEX MATCHALL "\nexport [a-z]+ [A-Za-z_]+" page_exports "${page_text}")
  list(TRANSFORM page_exports REPLACE "\nexport [a-z]+ " "")
  list(JOIN page_exports ", " page_exports)
  string(REPLACE "\nexport " "\n" page_text "${page_text}")
  string(APPEND page_program "const { ${page_exports} } = (() => {\n${page_text}return { ${page_exports} };\n})();\n")
endforeach()
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/report.css)
file(READ report.css page_style)
configure_file(page_program.h.in ${CMAKE_CURRENT_BINARY_DIR}/generated/services/results/report/page_program.h @ONLY)
