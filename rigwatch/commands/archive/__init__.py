"""The commands of archives: index, query, show, retain."""
