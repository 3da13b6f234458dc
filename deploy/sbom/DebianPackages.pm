# Which Debian package a file is of, and what a package is.
package DebianPackages;
use strict;
use warnings;
use Cwd qw(realpath);
use File::Basename qw(basename dirname);

my %owner_of;  # file => package, of all that are installed

sub read_lists {
  for my $list (glob '/var/lib/dpkg/info/*.list') {
    my $name = basename($list) =~ s/(:[a-z0-9]+)?\.list$//r;
    open(my $in, '<', $list) or die "$list: $!\n";
    while (<$in>) {
      chomp;
      $owner_of{$_} //= $name if m{\.(so|a|h|hpp|hh|inc|ipp|tcc|def|inl)|/bin/|/include/|/alternatives};
    }
  }
}

# FILE: the name of its package; undef when it is of none. Links are followed where the link itself is of none, and /lib
# is the same folder as /usr/lib, whichever of the two the package says.
sub owner {
  my ($file) = @_;
  read_lists() unless %owner_of;
  for my $name ($file, dirname($file) eq '.' ? () : realpath(dirname($file)) . '/' . basename($file), realpath($file)) {
    next unless defined $name;
    for my $alias ($name, $name =~ s{^/usr/}{/}r, "/usr$name") {
      return $owner_of{$alias} if $owner_of{$alias};
    }
  }
  return undef;
}

# NAMES of packages that are installed: for each a hash of version, architecture, source, source_version.
sub descriptions {
  my @names = @_;
  open(my $out, '-|', 'dpkg-query', '-W', '-f',
    join('\t', map { "\${$_}" } qw(binary:Package db:Status-Status Version Architecture source:Package source:Version)) .
    '\n', @names) or die "dpkg-query: $!\n";
  my %of;
  while (<$out>) {
    chomp;
    my ($name, $status, %is) = (split /\t/)[0, 1];
    @is{qw(version architecture source source_version)} = (split /\t/)[2 .. 5];
    $of{$name =~ s/:.*//r} //= \%is if $status eq 'installed';
  }
  close($out);
  for my $name (@names) { die "dpkg-query knows no installed package $name\n" unless $of{$name} }
  return \%of;
}

1;
