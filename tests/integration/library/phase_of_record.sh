# phase_of_record PROGRAM RECORD: runs the example over a minute of the record (RECORD_ch0_200perMV_360Hz.i16.gz) and holds
# its phases against the annotated beats (RECORD_beats.csv): from 10 s on the phase of each beat's sample is within 0.5 rad
# of zero (it is predicted) for nine beats in ten, half-way between two beats it is not, and the point moves by 3 mm to
# either side.
phase_of_record() {
  zcat "$2_ch0_200perMV_360Hz.i16.gz" | od -An -v -td2 -w2 | awk 'NR <= 21600 { print $1 / 200 }' | "$1" 360 > phases || return 1
  awk -v beats="$2_beats.csv" '
    BEGIN { FS = "," ; while ((getline < beats) > 0) if ($3 + 0 > 3600 && $3 + 0 < 21240) beat[++n] = $3 + 0; FS = " " }
    { at = int($1 * 360 + 0.5); split($0, f, " "); phase[at] = f[2]; z = f[6]; if (z > high) high = z; if (!low || z < low) low = z }
    function from_zero(p) { return p > 3.14159265 ? 6.2831853 - p : p }
    END {
      for (i = 1; i < n; ++i) {
        if ((beat[i] in phase) && from_zero(phase[beat[i]]) < 0.5) ++near
        middle = int((beat[i] + beat[i + 1]) / 2)
        if ((middle in phase) && from_zero(phase[middle]) > 2.0) ++far
      }
      printf "%d beats: %d near phase 0, %d half-way; z from %.2f to %.2f mm\n", n, near, far, low, high
      exit !(n > 50 && near > 0.9 * n && far > 0.9 * n && high > 82.99 && high < 83.01 && low > 76.99 && low < 77.01)
    }' phases
}
