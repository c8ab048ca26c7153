// make_certificates FOLDER: an authority, and a certificate of a server on 127.0.0.1 that it signed. Prints
// the three paths, a line each: authority, certificate, key.
#include <cstdio>

#include "tests/services/access/certificate_maker.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  weft::CertificateMaker maker(argv[1], "studio");
  const weft::CertificateFiles server = maker.Sign("weftd");
  std::printf("%s\n%s\n%s\n", maker.authority().c_str(), server.certificate.c_str(), server.key.c_str());
  return 0;
}
