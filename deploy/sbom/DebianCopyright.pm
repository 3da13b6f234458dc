# Machine-readable copyright files of Debian packages
# (https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/), and their licences' names in SPDX.
package DebianCopyright;
use strict;
use warnings;

# What Debian's files call it, in small letters => its name in SPDX. Other names have their text pointed at.
my %spdx = (expat => 'MIT', artistic => 'Artistic-1.0', apache => 'Apache-2.0', 'apache-2' => 'Apache-2.0',
  bsl => 'BSL-1.0', 'mpl-2' => 'MPL-2.0', 'epl-2' => 'EPL-2.0', 'epl-1' => 'EPL-1.0', cc0 => 'CC0-1.0');
$spdx{lc $_} = $_ for qw(Apache-2.0 BSD-2-Clause BSD-3-Clause BSD-4-Clause BSL-1.0 CC-BY-4.0 CC0-1.0 EPL-1.0 EPL-2.0 FTL
  IJG ISC Libpng MIT MPL-1.1 MPL-2.0 ODC-By-1.0 OpenSSL PostgreSQL Qhull Unlicense X11 Zlib curl);
for my $family (['GPL', qw(1 2 3)], ['LGPL', qw(2 2.1 3)], ['AGPL', qw(3)]) {
  my ($name, @versions) = @$family;
  for my $version (@versions) {
    my $number = $version =~ /\./ ? $version : "$version.0";
    for my $form ($version, $number) {
      $spdx{lc "$name-$form"} = "$name-$number-only";
      $spdx{lc "$name-$form+"} = "$name-$number-or-later";
    }
  }
}

# FILE: its paragraphs, each a hash of the fields with their lines; nothing when it is not machine-readable.
sub paragraphs {
  my ($file) = @_;
  open(my $in, '<:encoding(UTF-8)', $file) or return;
  my @paragraphs = ({});
  my $field;
  while (<$in>) {
    chomp;
    next if /^#/;
    if (/^\s*$/) {
      push @paragraphs, {} if %{$paragraphs[-1]};
      undef $field;
    } elsif (/^([A-Za-z-]+):\s*(.*)$/) {
      $field = ucfirst lc $1;
      $paragraphs[-1]{$field} = $2;
    } elsif (defined $field && /^\s+(.*)$/) {
      $paragraphs[-1]{$field} .= "\n" . ($1 eq '.' ? '' : $1);
    }
  }
  return unless ($paragraphs[0]{Format} // '') =~ /copyright-format|dep5/;
  return grep { %$_ } @paragraphs;
}

# FILE: those of its paragraphs that are of files: hashes with Files, Copyright, License (its name alone).
sub files {
  my ($file) = @_;
  return map { {Files => $_->{Files} =~ s/\s+/ /gr, Copyright => ($_->{Copyright} // '') =~ s/^\s+//r,
    License => ($_->{License} // '') =~ s/\n.*//sr} } grep { $_->{Files} } paragraphs($file);
}

# NAME, FILE: the licence of that name as an SPDX expression; names that SPDX does not have, with where their text is.
sub expression {
  my ($name, $file) = @_;
  my %texts;
  my $one = sub {
    my ($short) = @_;
    return $spdx{lc $short} if $spdx{lc $short};
    my $id = 'LicenseRef-debian-' . $short =~ s/[^A-Za-z0-9.-]+/-/gr;
    $texts{$id} = "The licence that Debian calls '$short': see $file";
    return $id;
  };
  # What has commas or exceptions is one name.
  return ($one->($name), \%texts) if $name =~ /,|\bwith\b|\band\/or\b/i || $name !~ /\S/;
  my @parts = split /\s+(and|or)\s+/i, $name;
  my $both = grep({ lc eq 'and' } @parts) && grep({ lc eq 'or' } @parts);
  return ($one->($name), \%texts) if $both;
  return (join(' ', map { /^(and|or)$/i ? uc : $one->($_) } @parts), \%texts);
}

# FILE of a package: declared (an SPDX expression of what is said of all its files, or NOASSERTION), names (each licence
# in the file), texts (of names that SPDX does not have).
sub of {
  my ($file) = @_;
  my @files = files($file);
  my %names = map { $_->{License} => 1 } grep { $_->{License} =~ /\S/ } @files;
  my ($all) = grep { $_->{Files} =~ /(^|\s)\*($|\s)/ && $_->{License} =~ /\S/ } @files;
  return (declared => 'NOASSERTION', names => [sort keys %names], texts => {}) unless $all;
  my ($declared, $texts) = expression($all->{License}, $file);
  return (declared => $declared, names => [sort keys %names], texts => $texts);
}

1;
