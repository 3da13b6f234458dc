#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "daemon/dds/security.hpp"
#include "daemon/keys/authority.hpp"
#include "daemon/keys/expiry_news.hpp"
#include "daemon/keys/key_digests.hpp"
#include "daemon/keys/key_folder.hpp"
#include "daemon/keys/signed_document.hpp"
#include "tests/unit/damage/damage.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
using std::chrono::days;
using ::testing::HasSubstr;

// Now, since OpenSSL looks at the clock itself in places.
const std::chrono::sys_seconds kNow = seconds_now();

class Keys : public ::testing::Test {
 protected:
  Keys() {
    std::string path = (fs::temp_directory_path() / "perimap-keys-XXXXXX").string();
    if (mkdtemp(path.data()) == nullptr) throw std::runtime_error("no folder");
    folder_ = path;
  }
  ~Keys() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }

  static Validity lasting(days d) { return {kNow - std::chrono::minutes(5), kNow + d}; }
  Authority authority(const std::string& in = "theatre") {
    auto made = Authority::create(folder_ / in, "Theatre 2", lasting(days(3650)));
    if (!made) throw std::runtime_error(made.error().message);
    return std::move(*made);
  }
  static fs::path issued(Authority& by, KeyRole role, const std::string& name, days d = days(365)) {
    const auto made = by.issue(role, name, lasting(d), false);
    if (!made) throw std::runtime_error(made.error().message);
    return *made;
  }
  static std::string refusal(const fs::path& keys, std::chrono::sys_seconds now = kNow) {
    const auto checked = check_keys(keys, now);
    return checked ? "in order" : checked.error().message;
  }
  static std::string text(const fs::path& file) {
    std::ostringstream all;
    all << std::ifstream(file, std::ios::binary).rdbuf();
    return all.str();
  }
  static unsigned mode(const fs::path& file) {
    struct stat facts {};
    EXPECT_EQ(stat(file.c_str(), &facts), 0) << file;
    return facts.st_mode & 0777U;
  }

  fs::path folder_;
};

TEST_F(Keys, AreInOrderAsIssuedAndSayWhoseTheyAreAndUntilWhen) {
  Authority by = authority();
  for (const RoleRights& rights : kRoles) {
    const fs::path keys = issued(by, rights.role, std::string("the-") + std::string(rights.name));
    const auto checked = check_keys(keys, kNow);
    ASSERT_TRUE(checked) << checked.error().message;
    EXPECT_EQ(checked->certificate.name, "the-" + std::string(rights.name));
    EXPECT_EQ(checked->certificate.role, rights.name);
    EXPECT_EQ(checked->ends, kNow + days(365));
    EXPECT_FALSE(expiry_warning(*checked, kNow));
  }
}

TEST_F(Keys, PrivateKeysAreForTheirOwnerAlone) {
  Authority by = authority();
  const fs::path keys = issued(by, KeyRole::kDisplay, "d");
  EXPECT_EQ(mode(keys / dds::key_files::kKey), 0600U);
  EXPECT_EQ(mode(folder_ / "theatre/authority/key.pem"), 0600U);
  EXPECT_EQ(mode(folder_ / "theatre/authority"), 0700U);
  chmod((keys / dds::key_files::kKey).c_str(), 0644);
  EXPECT_THAT(refusal(keys), HasSubstr("key.pem: others may read it"));
  chmod((keys / dds::key_files::kKey).c_str(), 0640);
  EXPECT_EQ(refusal(keys), "in order");
}

TEST_F(Keys, TheirEndIsToldWeeksBeforeAndRefusedAfter) {
  Authority by = authority();
  const fs::path keys = issued(by, KeyRole::kPublisher, "p", days(60));
  const auto early = check_keys(keys, kNow + days(31));
  ASSERT_TRUE(early);
  EXPECT_FALSE(expiry_warning(*early, kNow + days(31)));
  const auto late = check_keys(keys, kNow + days(33));
  ASSERT_TRUE(late);
  EXPECT_THAT(expiry_warning(*late, kNow + days(33)).value_or(""), HasSubstr("in 27 days"));
  EXPECT_THAT(refusal(keys, kNow + days(61)), HasSubstr("certificate.pem: has expired"));
  EXPECT_THAT(refusal(keys, kNow - days(1)), HasSubstr("certificate.pem: holds from"));
}

TEST_F(Keys, WhileAProgramRunsTheirEndIsToldOnceADayAndWhenItHasCome) {
  Authority by = authority();
  const auto keys = check_keys(issued(by, KeyRole::kPublisher, "p", days(60)), kNow);
  ASSERT_TRUE(keys);
  ExpiryNews news(*keys);
  int told = 0;
  std::string last;
  for (std::chrono::hours t(0); t < days(62); t += std::chrono::hours(1)) {
    const auto line = news.next(kNow + t);
    if (!line) continue;
    EXPECT_GE(t, days(32));
    ++told;
    last = *line;
  }
  EXPECT_EQ(told, 30);
  EXPECT_THAT(last, HasSubstr("have ended"));
  EXPECT_FALSE(ExpiryNews().next(kNow));
}

TEST_F(Keys, NoneOutlivesItsAuthority) {
  auto by = Authority::create(folder_ / "short", "Short", lasting(days(10)));
  ASSERT_TRUE(by);
  const auto checked = check_keys(issued(*by, KeyRole::kDisplay, "d"), kNow);
  ASSERT_TRUE(checked);
  EXPECT_EQ(checked->ends, kNow + days(10));
}

TEST_F(Keys, RevokedOnesAreToldInEveryFolderThatWasIssued) {
  Authority by = authority();
  const fs::path lost = issued(by, KeyRole::kDisplay, "lost");
  const fs::path kept = issued(by, KeyRole::kPublisher, "kept");
  ASSERT_EQ(by.revoke("lost", kNow).value_or(0), 1U);
  EXPECT_THAT(refusal(lost), HasSubstr("certificate.pem: is revoked"));
  EXPECT_EQ(refusal(kept), "in order");
  EXPECT_EQ(text(kept / dds::key_files::kRevoked), text(lost / dds::key_files::kRevoked));
  // Another run of the program goes on from what is there.
  auto again = Authority::open(folder_ / "theatre");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->revoke("lost", kNow).value_or(9), 0U);
  ASSERT_EQ(again->revoke("kept", kNow).value_or(0), 1U);
  EXPECT_THAT(refusal(lost), HasSubstr("is revoked"));
  EXPECT_THAT(refusal(kept), HasSubstr("is revoked"));
  const auto all = again->issued();
  ASSERT_TRUE(all);
  ASSERT_EQ(all->size(), 2U);
  EXPECT_EQ(all->front().facts.name, "kept");
  EXPECT_TRUE(all->front().revoked);
  EXPECT_THAT(again->revoke("nobody", kNow).error().message, HasSubstr("nothing was issued under this name"));
}

TEST_F(Keys, AreRenewedOnRequestAlone) {
  Authority by = authority();
  const fs::path keys = issued(by, KeyRole::kDisplay, "d");
  const std::string before = text(keys / dds::key_files::kCertificate);
  EXPECT_THAT(by.issue(KeyRole::kDisplay, "d", lasting(days(5)), false).error().message, HasSubstr("is there already"));
  ASSERT_TRUE(by.issue(KeyRole::kDisplay, "d", lasting(days(5)), true));
  EXPECT_NE(text(keys / dds::key_files::kCertificate), before);
  EXPECT_EQ(refusal(keys), "in order");
  EXPECT_EQ(by.revoke("d", kNow).value_or(0), 2U) << "both of that name";
}

TEST_F(Keys, OfAnotherRoleAreMadeWhenThoseOfBeforeAreRevoked) {
  Authority by = authority();
  const fs::path keys = issued(by, KeyRole::kPublisher, "p");
  EXPECT_THAT(by.issue(KeyRole::kDisplay, "p", lasting(days(5)), true).error().message,
              HasSubstr("has keys of a publisher that hold; revoke them first"));
  ASSERT_TRUE(by.revoke("p", kNow));
  ASSERT_TRUE(by.issue(KeyRole::kDisplay, "p", lasting(days(5)), true));
  EXPECT_EQ(refusal(keys), "in order");
}

TEST_F(Keys, ARevocationThatIsRepeatedIsWrittenAgain) {
  Authority by = authority();
  const fs::path lost = issued(by, KeyRole::kDisplay, "lost");
  const std::string before = text(lost / dds::key_files::kRevoked);
  ASSERT_TRUE(by.revoke("lost", kNow));
  std::ofstream(lost / dds::key_files::kRevoked, std::ios::binary) << before;  // as after half of it
  ASSERT_EQ(refusal(lost), "in order");
  EXPECT_EQ(by.revoke("lost", kNow).value_or(9), 0U);
  EXPECT_THAT(refusal(lost), HasSubstr("is revoked"));
}

// Governance by somebody whom the authority has let in: a chain that ends there is not enough.
TEST_F(Keys, ADocumentThatAMemberHasSignedIsRefused) {
  Authority by = authority();
  const fs::path keys = issued(by, KeyRole::kDisplay, "d");
  const auto certificate = parse_certificate(text(keys / dds::key_files::kCertificate), "d");
  const auto key = parse_key(text(keys / dds::key_files::kKey), "d");
  ASSERT_TRUE(certificate && key);
  const auto forged = sign_document(governance_xml(), **certificate, **key);
  ASSERT_TRUE(forged);
  std::ofstream(keys / dds::key_files::kGovernance, std::ios::binary) << *forged;
  EXPECT_THAT(refusal(keys), HasSubstr("governance.p7s: is not signed by this authority"));
}

TEST_F(Keys, OfAnotherAuthorityAreRefusedFileByFile) {
  Authority by = authority();
  Authority other = authority("other");
  const fs::path keys = issued(by, KeyRole::kDisplay, "d");
  const fs::path foreign = issued(other, KeyRole::kDisplay, "d");
  for (const char* file : {dds::key_files::kAuthority, dds::key_files::kCertificate, dds::key_files::kKey,
                           dds::key_files::kRevoked, dds::key_files::kGovernance, dds::key_files::kPermissions}) {
    const fs::path mixed = folder_ / "mixed";
    fs::copy(keys, mixed);
    fs::copy_file(foreign / file, mixed / file, fs::copy_options::overwrite_existing);
    EXPECT_THAT(refusal(mixed), HasSubstr(mixed.string())) << file;
    fs::remove_all(mixed);
  }
}

TEST_F(Keys, APermissionOfAnotherRoleOfTheSameAuthorityIsRefused) {
  Authority by = authority();
  const fs::path display = issued(by, KeyRole::kDisplay, "d");
  const fs::path publisher = issued(by, KeyRole::kPublisher, "p");
  fs::copy_file(publisher / dds::key_files::kPermissions, display / dds::key_files::kPermissions,
                fs::copy_options::overwrite_existing);
  EXPECT_THAT(refusal(display), HasSubstr("permissions.p7s: is of another certificate"));
}

// Bit flips and cuts of every file.
TEST_F(Keys, DamagedOnesAreNeverTakenForWhole) {
  Authority by = authority();
  const fs::path keys = issued(by, KeyRole::kPublisher, "p");
  ASSERT_EQ(by.revoke("p", kNow - days(1)).value_or(0), 1U);  // so that a list that cannot be read would show
  ASSERT_TRUE(by.issue(KeyRole::kPublisher, "p", lasting(days(365)), true));
  ASSERT_EQ(refusal(keys), "in order");
  constexpr std::array kNames{
      dds::key_files::kAuthority,  dds::key_files::kCertificate, dds::key_files::kKey, dds::key_files::kRevoked,
      dds::key_files::kGovernance, dds::key_files::kPermissions, kKeyDigests};
  test::Damage damage;
  for (int trial = 0; trial < test::Damage::kCopies; ++trial) {
    const fs::path file = keys / kNames.at(damage.one_of(kNames.size()));
    const std::string whole = text(file);
    const std::string damaged = damage.copy_of(whole);
    std::ofstream(file, std::ios::binary) << damaged;
    EXPECT_FALSE(check_keys(keys, kNow)) << file << ":\n" << damaged;
    std::ofstream(file, std::ios::binary) << whole;
  }
  EXPECT_EQ(refusal(keys), "in order");
}

TEST_F(Keys, ANameThatIsAPathIsRefused) {
  Authority by = authority();
  for (const char* name : {"", "../x", "a/b", ".hidden", "-x", "authority", "a b", "a<b"}) {
    EXPECT_THAT(by.issue(KeyRole::kDisplay, name, lasting(days(1)), false).error().message,
                HasSubstr("expected a name"))
        << name;
  }
}

TEST_F(Keys, AListOfTheRevokedThatAnotherHasSignedIsRefusedByTheAuthority) {
  {
    Authority by = authority();
    Authority other = authority("other");
  }
  fs::copy_file(folder_ / "other" / dds::key_files::kRevoked, folder_ / "theatre" / dds::key_files::kRevoked,
                fs::copy_options::overwrite_existing);
  const auto opened = Authority::open(folder_ / "theatre");
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().message, HasSubstr("revoked.pem: is not signed by this authority"));
}

TEST_F(Keys, ASecondAuthorityInOneFolderIsRefused) {
  Authority by = authority();
  EXPECT_THAT(Authority::create(folder_ / "theatre", "Again", lasting(days(1))).error().message,
              HasSubstr("there is an authority already"));
}

}  // namespace
}  // namespace perimap
