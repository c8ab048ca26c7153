// make_certificates FOLDER: an authority, and a certificate of a server on 127.0.0.1 that it signed. Prints
// paths, a line each: authority, certificate, key; the authority's list of revoked certificates; certificate
// and key of clients "expired", "revoked", "foreign" (of another authority) and "known".
#include <cstdio>
#include <string>

#include "tests/services/server/access/certificate_maker.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::string folder = argv[1], list = folder + "/revoked.crl";
  weft::CertificateMaker maker(folder, "studio"), other(folder, "other");
  const weft::CertificateFiles server = maker.Sign("weftd"), revoked = maker.Sign("revoked");
  maker.Revoke(revoked, list);
  std::printf("%s\n%s\n%s\n%s\n", maker.authority().c_str(), server.certificate.c_str(), server.key.c_str(),
              list.c_str());
  for (const weft::CertificateFiles& client :
       {maker.Sign("expired", 0), revoked, other.Sign("foreign"), maker.Sign("known")}) {
    std::printf("%s\n%s\n", client.certificate.c_str(), client.key.c_str());
  }
  return 0;
}
