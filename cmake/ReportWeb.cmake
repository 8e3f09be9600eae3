# SPDX-License-Identifier: Apache-2.0
# The report's front end: npm packages into the build folder, one bundle by esbuild, embedded as a string. Runs only when
# a file of loxo/report/web changed.
find_program(LOXO_NODE node)
find_program(LOXO_NPM npm)
if(NOT LOXO_NODE OR NOT LOXO_NPM)
  message(FATAL_ERROR "loxo: the report's front end needs Node.js 18 or later and npm, and one of them is not on PATH "
    "(node: ${LOXO_NODE}, npm: ${LOXO_NPM}). On Debian: apt-get install nodejs npm; './check' installs them.")
endif()

set(web ${PROJECT_SOURCE_DIR}/loxo/report/web)
set(web_build ${CMAKE_BINARY_DIR}/report-web)
set(bundle ${web_build}/web_bundle.cpp)
file(GLOB web_sources CONFIGURE_DEPENDS ${web}/*.js ${web}/*.mjs ${web}/*.css)

add_custom_command(OUTPUT ${web_build}/packages.stamp
  COMMAND ${CMAKE_COMMAND} -E make_directory ${web_build}
  COMMAND ${CMAKE_COMMAND} -E copy ${web}/package.json ${web}/package-lock.json ${web}/.npmrc ${web_build}
  COMMAND ${LOXO_NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error
  COMMAND ${CMAKE_COMMAND} -E touch ${web_build}/packages.stamp
  DEPENDS ${web}/package.json ${web}/package-lock.json ${web}/.npmrc
  WORKING_DIRECTORY ${CMAKE_BINARY_DIR}/report-web
  COMMENT "report: npm packages" VERBATIM)
file(MAKE_DIRECTORY ${web_build})
add_custom_command(OUTPUT ${bundle}
  COMMAND ${CMAKE_COMMAND} -E copy_if_different ${web_sources} ${web_build}
  COMMAND ${LOXO_NODE} build.mjs ${bundle}
  DEPENDS ${web_build}/packages.stamp ${web_sources}
  WORKING_DIRECTORY ${web_build}
  COMMENT "report: bundle" VERBATIM)
target_sources(loxo_report PRIVATE ${bundle})
