"""Sessions from and to the files of other tools: CSV, MAT and Parquet."""
