# Sourced by the DDS tests: DOMAIN and CYCLONEDDS_URI such that test runs on one host do not hear each other. The tag
# keeps participants of other runs apart even where the domain number happens to be the same.
# Needs PERIMAP_DEPLOY, the folder of cyclonedds-loopback.xml.
DOMAIN=$((20 + $$ % 100))
tag="perimap-test-$$-$(date +%s%N)"
export CYCLONEDDS_URI="file://$PERIMAP_DEPLOY/cyclonedds-loopback.xml,<CycloneDDS><Domain><Discovery><Tag>$tag</Tag></Discovery></Domain></CycloneDDS>"
