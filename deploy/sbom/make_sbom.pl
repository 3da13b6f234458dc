#!/usr/bin/perl
# make_sbom.pl --build FOLDER --source FOLDER --version VERSION --compiler PROGRAM --output FILE PROGRAM...
#
# The software bill of materials of what is installed, as SPDX 2.3 in JSON (https://spdx.github.io/spdx-spec/v2.3):
# which Debian packages, with versions and licences, the programs and modules that are named
#   - link as shared libraries, themselves or through another library (ldd)
#   - have in them as static libraries or by headers (what ninja noted when it built them)
#   - were built by (compiler, IDL compiler, CMake)
# and which data of others is in them (deploy/debian/copyright). Licences are those that a package's copyright file says
# of the whole of it, where that file is machine-readable; nobody has concluded anything from them.
#
# The same build on the same packages gives the same file but for the time, which $SOURCE_DATE_EPOCH sets.
use strict;
use warnings;
use Digest::SHA qw(sha1_hex);
use Cwd qw(realpath);
use File::Basename qw(basename);
use FindBin;
use Getopt::Long;
use JSON::PP;
use POSIX qw(strftime);
use lib $FindBin::Bin;
use DebianCopyright;
use DebianPackages;

my ($build, $source, $version, $compiler, $output);
GetOptions('build=s' => \$build, 'source=s' => \$source, 'version=s' => \$version, 'compiler=s' => \$compiler,
  'output=s' => \$output) or exit 2;
die "make_sbom.pl: --build, --source, --version, --compiler, --output and programs are needed\n"
  unless $build && $source && $version && $compiler && $output && @ARGV;
my @programs = map { -f ? realpath($_) : die "make_sbom.pl: there is no $_\n" } @ARGV;
$build = realpath($build);

sub lines_of { # COMMAND...: what it prints
  open(my $out, '-|', @_) or die "make_sbom.pl: $_[0]: $!\n";
  chomp(my @lines = <$out>);
  close($out) or die "make_sbom.pl: @_[0 .. ($#_ < 3 ? $#_ : 3)] failed\n";
  return @lines;
}

my %package;       # name of a Debian package => what it is there for
my %license_text;  # LicenseRef-... => what stands in the copyright file

# ---- shared libraries
for my $program (@programs) {
  my %direct = map { $_ => 1 } map { /\(NEEDED\).*\[(.*)\]/ ? $1 : () } lines_of('readelf', '-d', $program);
  for (lines_of('ldd', $program)) {
    die "make_sbom.pl: $program: $1 is not there\n" if /^\s+(\S+) => not found/;
    next unless m{^\s+(?:(\S+) => )?(/\S+) \(};
    my ($name, $file) = (basename($1 // $2), $2);
    next if index(realpath($file), "$build/") == 0;
    my $owner = DebianPackages::owner($file) // die "make_sbom.pl: $file is of no Debian package\n";
    $package{$owner}{$direct{$name} ? 'linked' : 'through others'}{$name} = 1;
  }
}

# ---- headers and static libraries
my @targets = map { substr($_, length("$build/")) } @programs;
my @inputs = lines_of('ninja', '-C', $build, '-t', 'inputs', @targets);
my @objects = grep { /\.(o|gch|pch)$/ && !m{^/} } @inputs;
die "make_sbom.pl: $build was not built\n" unless @objects;
my @deps = lines_of('ninja', '-C', $build, '-t', 'deps', @objects);
my ($unbuilt) = grep { /: deps not found/ } @deps;
die "make_sbom.pl: $build is not built as a whole: $unbuilt\n" if $unbuilt;
my %seen;
for my $file (grep { m{^/usr/} && !$seen{$_}++ } (grep { /\.a$/ } @inputs),
  map { /^    (\S+)$/ ? $1 : () } @deps) {
  my $owner = DebianPackages::owner($file) // die "make_sbom.pl: $file is of no Debian package\n";
  if ($file =~ /\.a$/) { $package{$owner}{static}{basename($file)} = 1 }
  else { $package{$owner}{headers}{yes} = 1 }
}

# ---- tools
for my $tool ($compiler, 'cmake', 'idlc') {
  my ($file) = grep { -x } $tool =~ m{/} ? $tool : map { "$_/$tool" } split /:/, $ENV{PATH};
  die "make_sbom.pl: there is no $tool\n" unless $file;
  my $owner = DebianPackages::owner(realpath($file));
  # A tool of another source is named with what it says of itself.
  if ($owner) { $package{$owner}{tool}{basename($tool)} = 1 }
  else { $package{$tool}{'tool, no package'}{(lines_of($file, '--version'))[0]} = 1 }
}

# ---- the document
sub id { return 'SPDXRef-' . $_[0] =~ s/[^A-Za-z0-9.-]+/-/gr }

sub element { # NAME, VERSION, DECLARED LICENCE, fields
  my ($name, $number, $license, %fields) = @_;
  return {SPDXID => id("Package-$name"), name => $name, versionInfo => $number, downloadLocation => 'NOASSERTION',
    filesAnalyzed => JSON::PP::false, licenseConcluded => 'NOASSERTION', licenseDeclared => $license,
    copyrightText => 'NOASSERTION', %fields};
}

my $described = DebianPackages::descriptions(grep { !$package{$_}{'tool, no package'} } sort keys %package);

sub debian_element { # NAME
  my ($name) = @_;
  my %is = %{$described->{$name}};
  my $file = "/usr/share/doc/$name/copyright";
  my %copyright = DebianCopyright::of($file);
  $license_text{$_} = $copyright{texts}{$_} for keys %{$copyright{texts}};
  my @names = @{$copyright{names}};
  (my $number = $is{version}) =~ s/([^A-Za-z0-9.~_-])/sprintf '%%%02X', ord $1/ge;
  (my $escaped = $name) =~ s/\+/%2B/g;
  return element($name, $is{version}, $copyright{declared},
    supplier => 'Organization: Debian',
    sourceInfo => "built from the Debian source package $is{source} $is{source_version}",
    licenseComments => @names ? "$file names: " . join('; ', @names) : "$file is not machine-readable",
    externalRefs => [{referenceCategory => 'PACKAGE-MANAGER', referenceType => 'purl',
      referenceLocator => "pkg:deb/debian/$escaped\@$number?arch=$is{architecture}"}]);
}

my $root = element('perimap', $version, 'Apache-2.0', supplier => 'NOASSERTION',
  primaryPackagePurpose => 'APPLICATION');
my @packages = ($root);
my @relationships = ({spdxElementId => 'SPDXRef-DOCUMENT', relationshipType => 'DESCRIBES',
  relatedSpdxElement => $root->{SPDXID}});

sub related { # ELEMENT, TYPE, ELEMENT, COMMENT
  my ($from, $type, $to, $comment) = @_;
  push @relationships, {spdxElementId => $from->{SPDXID}, relationshipType => $type,
    relatedSpdxElement => $to->{SPDXID}, comment => $comment};
}

for my $name (sort keys %package) {
  my %for = map { $_ => join(' ', sort keys %{$package{$name}{$_}}) } keys %{$package{$name}};
  my $element = exists $for{'tool, no package'} ? element(basename($name), $for{'tool, no package'}, 'NOASSERTION')
    : debian_element($name);
  push @packages, $element;
  related($root, 'DYNAMIC_LINK', $element, $for{linked}) if $for{linked};
  related($root, 'DEPENDS_ON', $element, "through other libraries: $for{'through others'}") if $for{'through others'};
  related($root, 'STATIC_LINK', $element, $for{static}) if $for{static};
  related($element, 'BUILD_DEPENDENCY_OF', $root, 'its headers are compiled in') if $for{headers};
  my $tool = $for{tool} // $for{'tool, no package'};
  related($element, 'BUILD_TOOL_OF', $root, $tool) if $tool;
}

# Each paragraph of the project's own copyright file but the first is of something by others.
for my $part (grep { $_->{Files} ne '*' } DebianCopyright::files("$source/deploy/debian/copyright")) {
  my ($license, $texts) = DebianCopyright::expression($part->{License}, "$source/deploy/debian/copyright");
  die "make_sbom.pl: deploy/debian/copyright: '$part->{License}' is not known\n" if %$texts;
  my $data = element("perimap data $part->{Files}", $version, $license, primaryPackagePurpose => 'OTHER',
    supplier => 'NOASSERTION', copyrightText => $part->{Copyright});
  push @packages, $data;
  related($root, 'CONTAINS', $data, 'compiled in');
}

my @texts = map { {licenseId => $_, name => s/^LicenseRef-debian-//r, extractedText => $license_text{$_}} }
  sort keys %license_text;
my $document = {spdxVersion => 'SPDX-2.3', dataLicense => 'CC0-1.0', SPDXID => 'SPDXRef-DOCUMENT',
  name => "perimap-$version", packages => \@packages, relationships => \@relationships,
  hasExtractedLicensingInfos => \@texts};
my $json = JSON::PP->new->canonical->pretty->utf8;
my $identity = sha1_hex($json->encode($document));
$document->{documentNamespace} = "https://perimap.example/spdx/perimap-$version-$identity";
$document->{creationInfo} = {creators => ['Tool: perimap-make_sbom.pl'],
  created => strftime('%Y-%m-%dT%H:%M:%SZ', gmtime($ENV{SOURCE_DATE_EPOCH} // time))};
open(my $out, '>', "$output.part") or die "make_sbom.pl: $output.part: $!\n";
print $out $json->encode($document);
close($out) && rename("$output.part", $output) or die "make_sbom.pl: $output: $!\n";
