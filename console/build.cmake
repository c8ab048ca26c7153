# Builds the pages in a folder of their own: cmake -D SOURCE= -D BUILD= -D PROTO= -D PROTOC= -D NPM= -D REQUIRED= -P build.cmake
# Nothing is written into the source tree.
set(generated ${BUILD}/generated)

function(run what)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${BUILD} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(status EQUAL 0)
    return()
  endif()
  if(REQUIRED)
    message(FATAL_ERROR "${what} failed:\n${output}")
  endif()
  set(failed TRUE PARENT_SCOPE)
  message(WARNING "${what} failed; weftd is built without the console's pages (-DWEFT_WITH_CONSOLE=OFF leaves them out):\n${output}")
endfunction()

file(SHA256 ${SOURCE}/package-lock.json lock)
set(installed "")
if(EXISTS ${BUILD}/installed)
  file(READ ${BUILD}/installed installed)
endif()
file(COPY ${SOURCE}/package.json ${SOURCE}/package-lock.json DESTINATION ${BUILD})
if(NOT installed STREQUAL lock)
  # The hashes of the lock decide what is accepted, so nothing needs a script of a package.
  run("npm ci" ${NPM} ci --ignore-scripts --no-audit --no-fund --prefer-offline)
  if(failed)
    return()
  endif()
  file(WRITE ${BUILD}/installed ${lock})
endif()

file(REMOVE_RECURSE ${generated} ${BUILD}/src)
file(MAKE_DIRECTORY ${generated})
file(GLOB_RECURSE protos ${PROTO}/weft/*.proto)
# What is wrong with the code itself is an error with and without REQUIRED.
set(REQUIRED ON)
run("protoc-gen-es" ${PROTOC} --plugin=protoc-gen-es=${BUILD}/node_modules/.bin/protoc-gen-es
  --es_out=${generated} --es_opt=target=ts -I ${PROTO} ${protos})
file(COPY ${SOURCE}/src ${SOURCE}/index.html ${SOURCE}/tsconfig.json ${SOURCE}/vite.config.ts DESTINATION ${BUILD})
run("npm run build" ${NPM} run build)
